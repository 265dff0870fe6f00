// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/synthetic/analytic_scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hapticd::drivers {
namespace {

using config::SyntheticNoise;
using config::SyntheticScene;
using rt::Vec3;

void round(const std::vector<float>& exact, std::uint16_t* raw) {
  for (std::size_t pixel = 0; pixel < exact.size(); ++pixel) {
    raw[pixel] = exact[pixel] >= 0 ? static_cast<std::uint16_t>(exact[pixel] + 0.5F) : rt::kRawNoMeasurement;
  }
}

}  // namespace

AnalyticScene::AnalyticScene(const config::SyntheticSettings& settings,
                             const rt::DepthModelParameters& depth_model)
    : settings_(settings),
      model_(depth_model),
      noise_(static_cast<std::uint32_t>(settings.seed),
             settings.noise == SyntheticNoise::harsh ? SensorNoise::harsh() : SensorNoise::recorded()),
      inverse_distance_per_m_(1 / settings.distance_m),
      inverse_distance_slope_per_m_(std::tan(settings.tilt_rad) / settings.distance_m),
      exact_(rt::kFramePixels) {
  for (int column = 0; column < rt::kFrameWidth; ++column) {
    ray_x_[static_cast<std::size_t>(column)] = (column - model_.cx_px) / model_.fx_px;
  }
  for (int row = 0; row < rt::kFrameHeight; ++row) {
    ray_y_[static_cast<std::size_t>(row)] = -(row - model_.cy_px) / model_.fy_px;
  }
  for (std::uint16_t raw = 0; raw < rt::kRawNoMeasurement; ++raw) {
    const double inverse_depth = model_.a_per_m * raw + model_.b_per_m;
    const bool within =
        inverse_depth > 0 && 1 / inverse_depth >= model_.near_m && 1 / inverse_depth <= model_.far_m;
    if (!within) continue;
    if (raw_first_ > raw_last_) raw_first_ = raw;
    raw_last_ = raw;
  }
}

Vec3 AnalyticScene::sphereCentre(double t_s) const {
  const bool moves = settings_.scene == SyntheticScene::moving_sphere;
  const double phase = 2 * std::numbers::pi * t_s / settings_.motion_period_s;
  return {moves ? settings_.motion_amplitude_m * std::sin(phase) : 0, 0, -settings_.distance_m};
}

double AnalyticScene::signedDistance(const Vec3& p, double t_s) const {
  const double to_ball = norm(p - sphereCentre(t_s)) - settings_.sphere_radius_m;
  const double to_wall = p.z + settings_.distance_m + settings_.sphere_radius_m;
  const Vec3 plane_normal{0, -std::sin(settings_.tilt_rad), std::cos(settings_.tilt_rad)};
  const double to_plane = dot(plane_normal, p - Vec3{0, 0, -settings_.distance_m});
  switch (settings_.scene) {
    case SyntheticScene::plane:
      return to_plane;
    case SyntheticScene::sphere:
      return to_ball;
    case SyntheticScene::moving_sphere:
      return std::min(to_ball, to_wall);
    case SyntheticScene::edge:
      return p.x > 0 && to_plane > 0 ? std::hypot(p.x, to_plane) : std::max(p.x, to_plane);
  }
  return 0;
}

/// Returns 1/Z where the ray (x, ray_y, -1) meets the tilted plane; not above 0 if it does not.
double AnalyticScene::inversePlaneDepth(double ray_y) const {
  return inverse_distance_per_m_ + inverse_distance_slope_per_m_ * ray_y;
}

/// Returns 1/Z where the ray (ray_x, ray_y, -1) enters the ball; not above 0 if it does not.
double AnalyticScene::inverseSphereDepth(double ray_x, double ray_y, const Vec3& centre) const {
  const Vec3 ray{ray_x, ray_y, -1};
  const double along = dot(ray, centre);
  const double c = dot(centre, centre) - settings_.sphere_radius_m * settings_.sphere_radius_m;
  const double discriminant = along * along - dot(ray, ray) * c;
  return discriminant < 0 || along <= 0 || c <= 0 ? 0 : (along + std::sqrt(discriminant)) / c;
}

double AnalyticScene::inverseDepth(double ray_x, double ray_y, const Vec3& centre) const {
  switch (settings_.scene) {
    case SyntheticScene::plane:
      return inversePlaneDepth(ray_y);
    case SyntheticScene::sphere:
      return inverseSphereDepth(ray_x, ray_y, centre);
    case SyntheticScene::moving_sphere:
      return std::max(inverseSphereDepth(ray_x, ray_y, centre),
                      1 / (settings_.distance_m + settings_.sphere_radius_m));
    case SyntheticScene::edge:
      return ray_x <= 0 ? inversePlaneDepth(ray_y) : 0;
  }
  return 0;
}

double AnalyticScene::trueDepth(int column, int row, double t_s) const {
  const double inverse_depth = inverseDepth(ray_x_.at(static_cast<std::size_t>(column)),
                                            ray_y_.at(static_cast<std::size_t>(row)), sphereCentre(t_s));
  return inverse_depth > 0 ? 1 / inverse_depth : 0;
}

float AnalyticScene::exactDisparity(double inverse_depth) const {
  const double disparity = (inverse_depth - model_.b_per_m) / model_.a_per_m;
  const bool measured = inverse_depth * model_.near_m <= 1 && inverse_depth * model_.far_m >= 1 &&
                        disparity >= 0 && disparity < rt::kRawNoMeasurement - 1;
  return measured ? static_cast<float>(disparity) : kNothingSeen;
}

void AnalyticScene::removeOutsideLimits(std::uint16_t* raw) const {
  for (std::size_t pixel = 0; pixel < rt::kFramePixels; ++pixel) {
    const bool outside = raw[pixel] < raw_first_ || raw[pixel] > raw_last_;
    raw[pixel] = outside ? rt::kRawNoMeasurement : raw[pixel];
  }
}

void AnalyticScene::render(double t_s, rt::DepthFrame& frame) {
  const Vec3 centre = sphereCentre(t_s);
  float* exact = exact_.data();
  for (const double ray_y : ray_y_) {
    for (const double ray_x : ray_x_) *exact++ = exactDisparity(inverseDepth(ray_x, ray_y, centre));
  }
  const auto number = static_cast<std::uint64_t>(std::llround(t_s * settings_.frame_rate_hz));
  switch (settings_.noise) {
    case SyntheticNoise::off:
      round(exact_, frame.raw);
      break;
    case SyntheticNoise::quantised:
      noise_.dither(number, exact_, frame.raw);
      break;
    case SyntheticNoise::sensor:
    case SyntheticNoise::harsh:
      noise_.applySensor(number, exact_, frame.raw);
      break;
  }
  removeOutsideLimits(frame.raw);
}

}  // namespace hapticd::drivers
