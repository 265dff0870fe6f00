// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/truth/any_camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace hapticd::tools {
namespace {

constexpr double kSubpixel_px = 0.08;

rt::DepthModelParameters depthCamera(int width_px, int height_px, double focal_px, double unit_m) {
  rt::DepthModelParameters camera;
  camera.width_px = width_px;
  camera.height_px = height_px;
  camera.fx_px = camera.fy_px = focal_px;
  camera.cx_px = 0.5 * width_px - 0.5;
  camera.cy_px = 0.5 * height_px - 0.5;
  camera.law = rt::DepthLawKind::linear;
  camera.unit_m = unit_m;
  camera.raw_no_measurement = 0;
  camera.raw_values = 65536;
  return camera;
}

/// White noise smoothed by a box, with unit variance.
class Noise {
 public:
  Noise(int width, int height, int box, std::uint32_t seed)
      : width_(width + box), box_(box), white_(static_cast<std::size_t>(width_ * (height + box))) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    for (double& value : white_) value = normal(random);
  }
  double at(int column, int row) const {
    double sum = 0;
    for (int v = row; v < row + box_; ++v) {
      for (int u = column; u < column + box_; ++u) sum += white_[static_cast<std::size_t>(v * width_ + u)];
    }
    return sum / box_;
  }

 private:
  int width_;
  int box_;
  std::vector<double> white_;
};

std::uint16_t rawOf(const rt::DepthModelParameters& camera, double depth_m) {
  if (!(depth_m > 0)) return camera.raw_no_measurement;
  const bool linear = camera.law == rt::DepthLawKind::linear;
  const double raw = linear ? depth_m / camera.unit_m : (1 / depth_m - camera.b_per_m) / camera.a_per_m;
  const double rounded = std::round(raw);
  if (rounded < 0 || rounded >= camera.raw_values || rounded == camera.raw_no_measurement)
    return camera.raw_no_measurement;
  return static_cast<std::uint16_t>(rounded);
}

}  // namespace

rt::DepthModelParameters stereoCamera(int width_px, int height_px, double field_of_view_deg,
                                      double baseline_m, double unit_m, double near_m, double far_m) {
  const double half_rad = 0.5 * field_of_view_deg * std::numbers::pi / 180;
  rt::DepthModelParameters camera =
      depthCamera(width_px, height_px, 0.5 * width_px / std::tan(half_rad), unit_m);
  camera.near_m = near_m;
  camera.far_m = far_m;
  camera.principle = rt::DepthPrinciple::active_stereo;
  camera.noise = {.c2_per_m = kSubpixel_px / (camera.fx_px * baseline_m), .correlation_px = 5};
  return camera;
}

rt::DepthModelParameters timeOfFlightCamera(int width_px, int height_px) {
  constexpr double kMillimetre_m = 0.001;
  rt::DepthModelParameters camera = depthCamera(width_px, height_px, 0.585 * width_px, kMillimetre_m);
  camera.principle = rt::DepthPrinciple::time_of_flight;
  camera.noise = {.c0_m = 0.0005, .c1 = 0.0015, .correlation_px = 1};
  return camera;
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

std::unique_ptr<rt::DepthFrame> frameOf(const rt::DepthModelParameters& camera, const DepthAt& depth,
                                        std::uint32_t seed) {
  auto frame = std::make_unique<rt::DepthFrame>();
  frame->camera = camera;
  frame->sequence = 1;
  std::ranges::fill(frame->image(), camera.raw_no_measurement);
  const Noise noise(camera.width_px, camera.height_px, static_cast<int>(camera.noise.correlation_px), seed);
  for (int row = 0; row < camera.height_px; ++row) {
    for (int column = 0; column < camera.width_px; ++column) {
      const double exact = depth(column, row);
      const double error =
          seed == 0 || !(exact > 0) ? 0 : camera.noise.sigma_m(exact) * noise.at(column, row);
      frame->raw[row * rt::strideOf(camera.width_px) + column] = rawOf(camera, exact > 0 ? exact + error : 0);
    }
  }
  return frame;
}

}  // namespace hapticd::tools
