// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "rt/base/parameters.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::test {

using FramePointer = std::unique_ptr<rt::DepthFrame>;

/// Returns a frame in which every pixel has this raw value. All frames made here have sequence number 1.
FramePointer frameOf(std::uint16_t raw);
/// Returns a frame with raw(u, v) at each pixel.
FramePointer frameOf(const std::function<std::uint16_t(int u, int v)>& raw);
/// Returns a frame with the raw values whose depths are nearest to depth_m(u, v); 2047 where that is not
/// positive or not finite.
FramePointer frameOfDepth(const rt::DepthModelParameters& model,
                          const std::function<double(int u, int v)>& depth_m);

/// Returns random 16-bit words, most of which are invalid raw values.
FramePointer damagedFrame(std::uint32_t seed);
/// Returns random raw values first..last.
FramePointer randomFrame(std::uint32_t seed, std::uint16_t first, std::uint16_t last);
/// Returns a slanted plane with a sphere in front of it and 0.1 raw units of Gaussian noise.
FramePointer planeAndSphereFrame(std::uint32_t seed, const rt::DepthModelParameters& model);
/// Returns the two values alternating like a chess board.
FramePointer checkerboardFrame(std::uint16_t even, std::uint16_t odd);

/// Sets the coefficients a and b such that raw 0 is at `nearest_m` and raw 2046 at `farthest_m`, with limits
/// just outside.
void spreadRawValuesOver(double nearest_m, double farthest_m, rt::DepthModelParameters& model);

}  // namespace hapticd::test
