// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "rt/depth_frame.h"
#include "rt/parameters.h"

namespace hapticd::drivers {

/// Writes depths in metres, row by row without padding, to frame.raw as the nearest raw values of a camera
/// with any depth law, and no measurement in the padding. Depths that are not above 0 stand for nothing seen.
/// The frame becomes one of the camera. RT: safe.
void deliverDepths(const rt::DepthModelParameters& camera, std::span<const float> depths_m,
                   rt::DepthFrame& frame);

/// The same, but each pixel is rounded randomly to one of the two nearest raw values such that the mean over
/// frames is exact; independent between pixels and frames.
void deliverDithered(const rt::DepthModelParameters& camera, std::uint32_t seed, std::uint64_t frame_number,
                     std::span<const float> depths_m, rt::DepthFrame& frame);

}  // namespace hapticd::drivers
