// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace hapticd::drivers {

/// The depth image of a Kinect v1: 640 columns u (left to right) and 480 rows v (top to bottom). Its rows
/// need no padding, so that the pixels of a frame are contiguous.
inline constexpr int kKinectWidth = 640;
inline constexpr int kKinectHeight = 480;
inline constexpr std::size_t kKinectPixels = std::size_t{kKinectWidth} * kKinectHeight;

/// Its raw disparities have 11 bits: 0..2046, rising with distance; 2047 means that there is no measurement.
inline constexpr int kKinectRawValues = 2048;
inline constexpr std::uint16_t kKinectNoMeasurement = 2047;

}  // namespace hapticd::drivers
