// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "tools/hapticctl/snapshot/snapshot.h"

namespace hapticd::tools {

/// All pixels with a depth as points in the world, a binary little-endian PLY file: float x, y, z in metres,
/// uchar red, green, blue. Colour shows depth; points within `radius_m` of the HIP are marked, and HIP and
/// proxy are the last two points where they are known.
std::string plyOf(const Snapshot& snapshot, double radius_m);

}  // namespace hapticd::tools
