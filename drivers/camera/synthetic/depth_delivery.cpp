// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/synthetic/depth_delivery.h"

#include <algorithm>
#include <cstddef>

#include "drivers/camera/synthetic/random_bits.h"
#include "drivers/camera/synthetic/random_levels.h"

namespace hapticd::drivers {
namespace {

constexpr std::uint32_t kDitherPurpose = 0x24;
constexpr double kNearest = 0.5;  // what is added before the fraction is cut off

/// `shareOf(pixel)`: 0..1, added to the exact raw value before its fraction is cut off.
template <typename ShareOf>
void deliver(const rt::DepthModelParameters& camera, std::span<const float> depths_m, rt::DepthFrame& frame,
             const ShareOf& shareOf) {
  frame.camera = camera;
  const auto width = static_cast<std::size_t>(camera.width_px);
  const auto stride = static_cast<std::size_t>(rt::strideOf(camera.width_px));
  const bool is_linear = camera.law == rt::DepthLawKind::linear;
  std::size_t pixel = 0;
  for (std::span<std::uint16_t> rest = frame.image(); !rest.empty(); rest = rest.subspan(stride)) {
    for (std::size_t column = 0; column < width; ++column, ++pixel) {
      const auto depth_m = static_cast<double>(depths_m[pixel]);
      const double exact =
          is_linear ? depth_m / camera.unit_m : (1 / depth_m - camera.b_per_m) / camera.a_per_m;
      const double raw = exact + shareOf(pixel);
      const bool has_raw = depth_m > 0 && raw >= 0 && raw < camera.raw_values;
      rest[column] = has_raw ? static_cast<std::uint16_t>(raw) : camera.raw_no_measurement;
    }
    std::ranges::fill(rest.subspan(width, stride - width), camera.raw_no_measurement);
  }
}

}  // namespace

void deliverDepths(const rt::DepthModelParameters& camera, std::span<const float> depths_m,
                   rt::DepthFrame& frame) {
  deliver(camera, depths_m, frame, [](std::size_t) { return kNearest; });
}

void deliverDithered(const rt::DepthModelParameters& camera, std::uint32_t seed, std::uint64_t frame_number,
                     std::span<const float> depths_m, rt::DepthFrame& frame) {
  const auto salt = static_cast<std::uint32_t>(bitsFor(seed, kDitherPurpose, frame_number));
  deliver(camera, depths_m, frame, [salt](std::size_t pixel) {
    return scramble32(static_cast<std::uint32_t>(pixel) * kCellFactor + salt) * 0x1p-32;
  });
}

}  // namespace hapticd::drivers
