// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/rt/scene/made_up_frame.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "drivers/camera/kinect_image.h"
#include "rt/base/vec3.h"

namespace hapticd::test {
namespace {

/// Depth of the scene along the ray of a pixel, in the optical frame (x right, y down, z forward).
double planeAndSphereDepth_m(const rt::DepthModelParameters& m, int u, int v) {
  constexpr double kRadius_m = 0.12;
  const auto planeDepth_m = [](double row) { return 1 / (1 / 1.5 + (1 / 0.8 - 1 / 1.5) * row / 479); };
  const auto rayOf = [&m](double column, double row) {
    return rt::Vec3{(column - m.cx_px) / m.fx_px, (row - m.cy_px) / m.fy_px, 1};
  };
  const rt::Vec3 centre = (planeDepth_m(250) - 0.05) * rayOf(300, 250);
  const rt::Vec3 ray = rayOf(u, v);
  const double along = dot(ray, centre);
  const double root = along * along - dot(ray, ray) * (dot(centre, centre) - kRadius_m * kRadius_m);
  const double plane = planeDepth_m(v);
  return root < 0 ? plane : std::min(plane, (along - std::sqrt(root)) / dot(ray, ray));
}

}  // namespace

FramePointer frameOf(const std::function<std::uint16_t(int, int)>& raw) {
  auto frame = std::make_unique<rt::DepthFrame>();
  for (int v = 0; v < drivers::kKinectHeight; ++v) {
    for (int u = 0; u < drivers::kKinectWidth; ++u) frame->raw[v * drivers::kKinectWidth + u] = raw(u, v);
  }
  frame->sequence = 1;
  return frame;
}

FramePointer frameOf(std::uint16_t raw) {
  return frameOf([raw](int, int) { return raw; });
}

FramePointer frameOfDepth(const rt::DepthModelParameters& model,
                          const std::function<double(int, int)>& depth_m) {
  return frameOf([&](int u, int v) -> std::uint16_t {
    const double depth = depth_m(u, v);
    if (!std::isfinite(depth) || depth <= 0) return drivers::kKinectNoMeasurement;
    const double raw = std::round((1 / depth - model.b_per_m) / model.a_per_m);
    return raw < 0 || raw > 2046 ? drivers::kKinectNoMeasurement : static_cast<std::uint16_t>(raw);
  });
}

FramePointer damagedFrame(std::uint32_t seed) {
  std::mt19937 random(seed);
  return frameOf([&random](int, int) { return static_cast<std::uint16_t>(random()); });
}

FramePointer randomFrame(std::uint32_t seed, std::uint16_t first, std::uint16_t last) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> raw(first, last);
  return frameOf([&](int, int) { return static_cast<std::uint16_t>(raw(random)); });
}

FramePointer planeAndSphereFrame(std::uint32_t seed, const rt::DepthModelParameters& model) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 0.1);
  return frameOf([&](int u, int v) {
    const double raw = (1 / planeAndSphereDepth_m(model, u, v) - model.b_per_m) / model.a_per_m;
    return static_cast<std::uint16_t>(std::clamp(std::round(raw + noise(random)), 0.0, 2046.0));
  });
}

FramePointer checkerboardFrame(std::uint16_t even, std::uint16_t odd) {
  return frameOf([=](int u, int v) { return (u + v) % 2 == 0 ? even : odd; });
}

void spreadRawValuesOver(double nearest_m, double farthest_m, rt::DepthModelParameters& model) {
  model.b_per_m = 1 / nearest_m;
  model.a_per_m = (1 / farthest_m - 1 / nearest_m) / 2046;
  model.near_m = nearest_m * 0.999;
  model.far_m = farthest_m * 1.001;
}

}  // namespace hapticd::test
