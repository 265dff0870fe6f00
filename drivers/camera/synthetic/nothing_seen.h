// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hapticd::drivers {

/// Value of an exact disparity or depth where the scene shows nothing at a pixel.
inline constexpr float kNothingSeen = -1;

}  // namespace hapticd::drivers
