// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/truth/any_camera.h"

#include <cmath>
#include <cstddef>
#include <vector>

#include "config/settings/depth_cameras.h"
#include "drivers/camera/synthetic/depth_sensor.h"

namespace hapticd::tools {
rt::DepthModelParameters fineDepthModel(double near_m, double far_m) {
  constexpr double kSteps = 2046;
  constexpr double kRounding = 1e-9;  // so that the first and the last raw value are not out of range
  rt::DepthModelParameters model;
  model.a_per_m = (1 / far_m - 1 / near_m) / kSteps;
  model.b_per_m = 1 / near_m;
  model.near_m = near_m * (1 - kRounding);
  model.far_m = far_m * (1 + kRounding);
  return model;
}

rt::DepthModelParameters fineDepthModelAround(double middle_m, double beyond_m) {
  const double far_m = middle_m + beyond_m;
  return fineDepthModel(1 / (2 / middle_m - 1 / far_m), far_m);
}

rt::DepthModelParameters stereoCamera(int width_px, int height_px, double field_of_view_deg,
                                      double baseline_m, double unit_m, double near_m, double far_m) {
  rt::DepthModelParameters camera =
      config::stereoCamera({width_px, height_px}, field_of_view_deg, baseline_m);
  camera.unit_m = unit_m;
  camera.near_m = near_m;
  camera.far_m = far_m;
  return camera;
}

rt::DepthModelParameters timeOfFlightCamera(int width_px, int height_px) {
  return config::timeOfFlightCamera({width_px, height_px});
}

rt::DepthModelParameters kinectWithNoise() {
  rt::DepthModelParameters camera;
  camera.noise = {.c2_per_m = rt::kKinectNoise_raw * std::abs(camera.a_per_m), .correlation_px = 9};
  return camera;
}

DepthAt tiltedPlane(const rt::DepthModelParameters& camera, double distance_m, double tilt_rad) {
  return [camera, distance_m, tilt_rad](double, double row) {
    const double up = (camera.cy_px - row) / camera.fy_px;
    return distance_m / (1 + up * std::tan(tilt_rad));
  };
}

DepthAt ball(const rt::DepthModelParameters& camera, const rt::Vec3& centre_m_in_camera, double radius_m) {
  return [=](double column, double row) {
    const rt::Vec3 ray{(column - camera.cx_px) / camera.fx_px, (camera.cy_px - row) / camera.fy_px, -1};
    const double along = dot(ray, centre_m_in_camera) / dot(ray, ray);
    const rt::Vec3 beside = centre_m_in_camera - along * ray;
    const double inside = radius_m * radius_m - dot(beside, beside);
    return inside < 0 ? 0 : along - std::sqrt(inside / dot(ray, ray));
  };
}

FrameSequence::FrameSequence(const rt::DepthModelParameters& camera, const DepthAt& depth, std::uint32_t seed)
    : camera_(camera) {
  exact_m_.reserve(static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px));
  for (int row = 0; row < camera.height_px; ++row) {
    for (int column = 0; column < camera.width_px; ++column)
      exact_m_.push_back(static_cast<float>(depth(column, row)));
  }
  if (seed != 0) noise_.emplace(camera, seed);
}

std::unique_ptr<rt::DepthFrame> FrameSequence::next() {
  auto frame = std::make_unique<rt::DepthFrame>();
  frame->sequence = ++number_;
  std::vector<float> depths_m = exact_m_;
  if (noise_) noise_->addTo(number_, depths_m);
  drivers::deliverDepths(camera_, depths_m, *frame);
  return frame;
}

std::unique_ptr<rt::DepthFrame> frameOf(const rt::DepthModelParameters& camera, const DepthAt& depth,
                                        std::uint32_t seed) {
  return FrameSequence(camera, depth, seed).next();
}

std::string_view nameOf(SceneNoise noise) {
  constexpr std::array<std::string_view, 4> kNames{"none", "quantised", "sensor", "harsh"};
  return kNames.at(static_cast<std::size_t>(noise));
}

drivers::SensorNoise::Parameters sensorParameters(SceneNoise noise) {
  return noise == SceneNoise::harsh ? drivers::SensorNoise::harsh() : drivers::SensorNoise::recorded();
}

void SceneSensor::deliver(const drivers::SceneCamera& camera, std::uint64_t frame_number, SceneNoise noise,
                          rt::DepthFrame& frame) {
  frame.sequence = frame_number;
  frame.device_ticks = 0;
  if (!isSensorNoise(noise)) {
    camera.deliverRounded(frame);
    return;
  }
  if (camera.model().law == rt::DepthLawKind::linear) {
    std::vector<float> depths_m = camera.exact();
    depth_noises_.try_emplace(noise, camera.model(), seed_, noise == SceneNoise::harsh ? 2 : 1)
        .first->second.addTo(frame_number, depths_m);
    return drivers::deliverDepths(camera.model(), depths_m, frame);
  }
  drivers::SensorNoise::Parameters parameters = sensorParameters(noise);
  if (!leaves_shadows_) parameters.shadow_side = drivers::ShadowSide::none;
  sensors_.try_emplace(noise, seed_, parameters)
      .first->second.applySensor(frame_number, camera.exact(), frame.raw);
}

}  // namespace hapticd::tools
