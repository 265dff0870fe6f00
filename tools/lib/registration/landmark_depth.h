// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "config/base/error.h"
#include "rt/depth/depth_model.h"
#include "tools/lib/registration/point_files.h"

namespace hapticd::tools {

/// Pixels about a landmark whose depths count, in each direction: 5 by 5 of them.
inline constexpr int kLandmarkReach_px = 2;

/// Where the camera sees a landmark, metres, camera frame: along the ray of its pixel, at the median depth of
/// the pixels about it. `frame`: the camera's raw values, row by row, without padding. Errors: the pixel lies
/// outside the image, or fewer than half of these pixels have a depth.
base::Result<rt::Vec3> positionInCamera(const Landmark& landmark, std::span<const std::uint16_t> frame,
                                        const rt::DepthModelParameters& model);

}  // namespace hapticd::tools
