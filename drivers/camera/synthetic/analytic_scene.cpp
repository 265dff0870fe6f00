// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/synthetic/analytic_scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "config/settings/depth_cameras.h"

namespace hapticd::drivers {
namespace {

using rt::Vec3;

/// A camera that delivers depth is that much noisier than it states where the noise is harsh.
constexpr double kHarshScale = 2;

}  // namespace

AnalyticScene::AnalyticScene(const SyntheticSettings& settings, const rt::DepthModelParameters& depth_model)
    : settings_(settings),
      camera_(depth_model),
      inverse_distance_per_m_(1 / settings.distance_m),
      inverse_distance_slope_per_m_(std::tan(settings.tilt_rad) / settings.distance_m) {
  const auto seed = static_cast<std::uint32_t>(settings.seed);
  const bool is_harsh = settings.noise == SyntheticNoise::harsh;
  if (depth_model.law == rt::DepthLawKind::reciprocal) {
    kinect_.emplace(seed, is_harsh ? SensorNoise::harsh() : SensorNoise::recorded());
  } else {
    depth_sensor_.emplace(depth_model, seed,
                          DepthSensor::Parameters{.baseline_m = config::kD435Baseline_m,
                                                  .noise_scale = is_harsh ? kHarshScale : 1});
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

/// Returns 1/Z where the ray (x, y, -1) meets the tilted plane; not above 0 if it does not.
double AnalyticScene::inversePlaneDepth(const Vec3& ray) const {
  return inverse_distance_per_m_ + inverse_distance_slope_per_m_ * ray.y;
}

/// Returns 1/Z where the ray (x, y, -1) enters the ball; not above 0 if it does not.
double AnalyticScene::inverseSphereDepth(const Vec3& ray, const Vec3& centre) const {
  const double along = dot(ray, centre);
  const double c = dot(centre, centre) - settings_.sphere_radius_m * settings_.sphere_radius_m;
  const double discriminant = along * along - dot(ray, ray) * c;
  return discriminant < 0 || along <= 0 || c <= 0 ? 0 : (along + std::sqrt(discriminant)) / c;
}

double AnalyticScene::inverseDepth(const Vec3& ray, const Vec3& centre) const {
  switch (settings_.scene) {
    case SyntheticScene::plane:
      return inversePlaneDepth(ray);
    case SyntheticScene::sphere:
      return inverseSphereDepth(ray, centre);
    case SyntheticScene::moving_sphere:
      return std::max(inverseSphereDepth(ray, centre),
                      1 / (settings_.distance_m + settings_.sphere_radius_m));
    case SyntheticScene::edge:
      return ray.x <= 0 ? inversePlaneDepth(ray) : 0;
  }
  return 0;
}

double AnalyticScene::trueDepth(int column, int row, double t_s) const {
  const double inverse_depth = inverseDepth(camera_.rayThrough(column, row), sphereCentre(t_s));
  return inverse_depth > 0 ? 1 / inverse_depth : 0;
}

void AnalyticScene::render(double t_s, rt::DepthFrame& frame) {
  frame.camera = camera_.model();
  camera_.measure([this, centre = sphereCentre(t_s)](const Vec3& ray) { return inverseDepth(ray, centre); });
  const auto number = static_cast<std::uint64_t>(std::llround(t_s * settings_.frame_rate_hz));
  if (settings_.noise == SyntheticNoise::off) {
    camera_.deliverRounded(frame);
  } else if (kinect_) {
    renderDisparities(number, frame);
  } else {
    renderDepths(number, frame);
  }
  camera_.removeOutsideLimits(frame);
}

void AnalyticScene::renderDisparities(std::uint64_t number, rt::DepthFrame& frame) const {
  if (settings_.noise == SyntheticNoise::quantised) {
    kinect_->dither(number, camera_.exact(), frame.raw);
  } else {
    kinect_->applySensor(number, camera_.exact(), frame.raw);
  }
}

void AnalyticScene::renderDepths(std::uint64_t number, rt::DepthFrame& frame) const {
  if (settings_.noise == SyntheticNoise::quantised) {
    depth_sensor_->dither(number, camera_.exact(), frame);
  } else {
    depth_sensor_->applySensor(number, camera_.exact(), frame);
  }
}

}  // namespace hapticd::drivers
