// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "rt/base/parameters.h"

namespace hapticd::rt {

/// Returns the rotation of T_world_x, row by row (rows are world axes): roll about the world's x axis first,
/// then pitch about y, then yaw about z.  RT: not safe (for constructors).
std::array<double, 9> rotationOf(const PoseParameters& pose);

}  // namespace hapticd::rt
