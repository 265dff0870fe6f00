// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/synthetic/scene_camera.h"

#include <algorithm>

#include "drivers/camera/kinect_image.h"
#include "drivers/camera/synthetic/depth_sensor.h"

namespace hapticd::drivers {
namespace {

/// A depth that the first or the last raw value stands for is measured although rounding may put its
/// disparity just beyond that value, in raw units.
constexpr double kRounding_raw = 1e-6;

}  // namespace

SceneCamera::SceneCamera(const rt::DepthModelParameters& model)
    : model_(model),
      exact_(static_cast<std::size_t>(model.width_px) * static_cast<std::size_t>(model.height_px)) {
  for (int column = 0; column < model.width_px; ++column) ray_x_.push_back(rayThrough(column, 0).x);
  for (int row = 0; row < model.height_px; ++row) ray_y_.push_back(rayThrough(0, row).y);
  const bool is_linear = model.law == rt::DepthLawKind::linear;
  for (std::uint32_t raw = 0; raw < model.raw_values; ++raw) {
    if (raw == model.raw_no_measurement) continue;
    const double inverse_depth = is_linear ? 1 / (model.unit_m * raw) : model.a_per_m * raw + model.b_per_m;
    const bool within =
        inverse_depth > 0 && 1 / inverse_depth >= model.near_m && 1 / inverse_depth <= model.far_m;
    if (!within) continue;
    if (raw_first_ > raw_last_) raw_first_ = static_cast<std::uint16_t>(raw);
    raw_last_ = static_cast<std::uint16_t>(raw);
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

float SceneCamera::exactDepth_m(double inverse_depth) const noexcept {
  const bool measured = inverse_depth * model_.near_m <= 1 && inverse_depth * model_.far_m >= 1;
  return measured ? static_cast<float>(1 / inverse_depth) : kNothingSeen;
}

void SceneCamera::deliverRounded(rt::DepthFrame& frame) const {
  if (model_.law == rt::DepthLawKind::linear) return deliverDepths(model_, exact_, frame);
  std::ranges::transform(exact_, frame.image().begin(), [](float exact) {
    return exact >= 0 ? static_cast<std::uint16_t>(exact + 0.5F) : kKinectNoMeasurement;
  });
}

void SceneCamera::removeOutsideLimits(rt::DepthFrame& frame) const {
  for (std::uint16_t& raw : frame.image()) {
    if (raw < raw_first_ || raw > raw_last_) raw = model_.raw_no_measurement;
  }
}

}  // namespace hapticd::drivers
