// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/synthetic/scene_camera.h"

#include <algorithm>

#include "drivers/camera/kinect_image.h"

namespace hapticd::drivers {
namespace {

/// A depth that the first or the last raw value stands for is measured although rounding may put its
/// disparity just beyond that value, in raw units.
constexpr double kRounding_raw = 1e-6;

}  // namespace

SceneCamera::SceneCamera(const rt::DepthModelParameters& model) : model_(model), exact_(kKinectPixels) {
  for (int column = 0; column < kKinectWidth; ++column) {
    ray_x_[static_cast<std::size_t>(column)] = rayThrough(column, 0).x;
  }
  for (int row = 0; row < kKinectHeight; ++row) {
    ray_y_[static_cast<std::size_t>(row)] = rayThrough(0, row).y;
  }
  for (std::uint16_t raw = 0; raw < kKinectNoMeasurement; ++raw) {
    const double inverse_depth = model_.a_per_m * raw + model_.b_per_m;
    const bool within =
        inverse_depth > 0 && 1 / inverse_depth >= model_.near_m && 1 / inverse_depth <= model_.far_m;
    if (!within) continue;
    if (raw_first_ > raw_last_) raw_first_ = raw;
    raw_last_ = raw;
  }
}

rt::Vec3 SceneCamera::rayThrough(double column, double row) const noexcept {
  return {(column - model_.cx_px) / model_.fx_px, -(row - model_.cy_px) / model_.fy_px, -1};
}

float SceneCamera::exactDisparity(double inverse_depth) const noexcept {
  const double disparity = (inverse_depth - model_.b_per_m) / model_.a_per_m;
  const bool measured = inverse_depth * model_.near_m <= 1 && inverse_depth * model_.far_m >= 1 &&
                        disparity > -kRounding_raw && disparity < kKinectNoMeasurement - 1 + kRounding_raw;
  return measured ? static_cast<float>(std::max(disparity, 0.0)) : kNothingSeen;
}

void SceneCamera::deliverRounded(rt::DepthFrame& frame) const {
  std::ranges::transform(exact_, frame.image().begin(), [](float exact) {
    return exact >= 0 ? static_cast<std::uint16_t>(exact + 0.5F) : kKinectNoMeasurement;
  });
}

void SceneCamera::removeOutsideLimits(rt::DepthFrame& frame) const {
  for (std::uint16_t& raw : frame.image()) {
    if (raw < raw_first_ || raw > raw_last_) raw = kKinectNoMeasurement;
  }
}

}  // namespace hapticd::drivers
