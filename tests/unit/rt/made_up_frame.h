// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "rt/depth_frame.h"
#include "rt/parameters.h"

namespace hapticd::test {

using FramePointer = std::unique_ptr<rt::DepthFrame>;

/// Every pixel has this raw value. All frames made here have sequence number 1.
FramePointer frameOf(std::uint16_t raw);
/// raw(u, v) for each pixel.
FramePointer frameOf(const std::function<std::uint16_t(int u, int v)>& raw);
/// The raw value whose depth comes nearest to depth_m(u, v); 2047 where that is not positive or not finite.
FramePointer frameOfDepth(const rt::DepthModelParameters& model,
                          const std::function<double(int u, int v)>& depth_m);

/// Random 16-bit words: most are no raw values at all.
FramePointer damagedFrame(std::uint32_t seed);
/// Random raw values first..last.
FramePointer randomFrame(std::uint32_t seed, std::uint16_t first, std::uint16_t last);
/// The slanted plane with a sphere in front of it of haptics.md 1.11, with 0.1 raw units of Gaussian noise.
FramePointer planeAndSphereFrame(std::uint32_t seed, const rt::DepthModelParameters& model);
/// The two values in turn, like a chess board.
FramePointer checkerboardFrame(std::uint16_t even, std::uint16_t odd);

/// Coefficients a and b by which raw 0 is `nearest_m` and raw 2046 is `farthest_m`, with limits just outside.
void spreadRawValuesOver(double nearest_m, double farthest_m, rt::DepthModelParameters& model);

}  // namespace hapticd::test
