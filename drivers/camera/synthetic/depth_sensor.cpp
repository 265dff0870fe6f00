// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/synthetic/depth_sensor.h"

#include <algorithm>
#include <cstddef>
#include <vector>

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

DepthSensor::DepthSensor(const rt::DepthModelParameters& camera, std::uint32_t seed,
                         const Parameters& parameters)
    : camera_(camera),
      seed_(seed),
      edges_(camera, parameters.baseline_m, seed),
      noise_(camera, seed, parameters.noise_scale) {}

void DepthSensor::dither(std::uint64_t frame_number, std::span<const float> exact_m,
                         rt::DepthFrame& frame) const {
  deliverDithered(camera_, seed_, frame_number, exact_m, frame);
}

void DepthSensor::applySensor(std::uint64_t frame_number, std::span<const float> exact_m,
                              rt::DepthFrame& frame) const {
  std::vector<float> depths_m(exact_m.begin(), exact_m.end());
  edges_.applyTo(depths_m);
  noise_.addTo(frame_number, depths_m);
  deliverDepths(camera_, depths_m, frame);
}

}  // namespace hapticd::drivers
