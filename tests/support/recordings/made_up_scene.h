// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "rt/base/vec3.h"

namespace hapticd::test {

/// Returns the raw image (640 x 480) of a wall perpendicular to the optical axis.
std::vector<std::uint16_t> wallImage(std::uint16_t raw);

/// Returns the raw image of a ball in front of a tilted wall, with noise, holes, dead columns and values
/// without a valid depth. The ball moves to the right from frame to frame.
std::vector<std::uint16_t> sceneImage(std::uint32_t frame);

/// Returns `count` positions in metres on points and within 0.04 m of them: every fourth on a point itself,
/// the others along the ray from the camera, along z and in all directions. The same seed gives the same
/// positions.
std::vector<rt::Vec3> positionsNear(const std::vector<rt::Vec3>& points_m, std::size_t count,
                                    std::uint64_t seed);

}  // namespace hapticd::test
