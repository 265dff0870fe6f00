// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hapticd::drivers {

/// What an exact disparity is when the scene shows nothing at a pixel.
inline constexpr float kNothingSeen = -1;

}  // namespace hapticd::drivers
