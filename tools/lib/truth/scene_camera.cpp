// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/truth/scene_camera.h"

#include <algorithm>

namespace hapticd::tools {

std::string_view nameOf(SceneNoise noise) {
  constexpr std::array<std::string_view, 4> kNames{"none", "quantised", "sensor", "harsh"};
  return kNames.at(static_cast<std::size_t>(noise));
}

drivers::SensorNoise::Parameters sensorParameters(SceneNoise noise) {
  return noise == SceneNoise::harsh ? drivers::SensorNoise::harsh() : drivers::SensorNoise::recorded();
}

SceneCamera::SceneCamera(const rt::DepthModelParameters& model, std::uint32_t seed, bool leaves_shadows)
    : model_(model), seed_(seed), leaves_shadows_(leaves_shadows), exact_(rt::kFramePixels) {
  for (std::size_t raw = 0; raw < rt::kRawNoMeasurement; ++raw) {
    const double inverse_depth = model_.a_per_m * static_cast<double>(raw) + model_.b_per_m;
    within_limits_[raw] =
        inverse_depth > 0 && 1 / inverse_depth >= model_.near_m && 1 / inverse_depth <= model_.far_m;
  }
}

rt::Vec3 SceneCamera::rayThrough(double column, double row) const noexcept {
  return {(column - model_.cx_px) / model_.fx_px, -(row - model_.cy_px) / model_.fy_px, -1};
}

float SceneCamera::exactDisparity(double depth_m) const {
  const double disparity = (1 / depth_m - model_.b_per_m) / model_.a_per_m;
  const bool measured = depth_m >= model_.near_m && depth_m <= model_.far_m && disparity > -0.5 &&
                        disparity < rt::kRawNoMeasurement - 0.5;
  return measured ? static_cast<float>(std::max(disparity, 0.0)) : drivers::kNothingSeen;
}

void SceneCamera::deliver(std::uint64_t frame_number, SceneNoise noise, rt::DepthFrame& frame) {
  frame.sequence = frame_number;
  frame.device_ticks = 0;
  if (!isSensorNoise(noise)) {
    std::ranges::transform(exact_, frame.raw, [](float exact) {
      return exact >= 0 ? static_cast<std::uint16_t>(exact + 0.5F) : rt::kRawNoMeasurement;
    });
    return;
  }
  drivers::SensorNoise::Parameters parameters = sensorParameters(noise);
  if (!leaves_shadows_) parameters.shadow_side = drivers::ShadowSide::none;
  sensors_.try_emplace(noise, seed_, parameters).first->second.applySensor(frame_number, exact_, frame.raw);
}

void SceneCamera::removeOutsideLimits(rt::DepthFrame& frame) const {
  for (std::uint16_t& raw : frame.raw) {
    if (!within_limits_[std::min(raw, rt::kRawNoMeasurement)]) raw = rt::kRawNoMeasurement;
  }
}

}  // namespace hapticd::tools
