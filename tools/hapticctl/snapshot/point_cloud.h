// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "tools/hapticctl/snapshot/snapshot.h"

namespace hapticd::tools {

/// A binary little-endian PLY file of all pixels with a depth, as points in the world: float x, y, z in
/// metres, uchar red, green, blue. The colour shows the depth; points within `radius_m` of the HIP are
/// marked. Proxy and HIP are the last two points, if they are known.
std::string plyOf(const Snapshot& snapshot, double radius_m);

}  // namespace hapticd::tools
