// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/pareto/hard_frames.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "drivers/camera/kinect_image.h"
#include "rt/depth_model.h"
#include "tools/hapticbench/pareto/touching_path.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

/// Returns the raw value whose depth is nearest to `depth_m`.
std::uint16_t rawAt(const rt::DepthModel& model, double depth_m) {
  std::uint16_t best = 0;
  for (std::uint16_t raw = 0; raw < drivers::kKinectRawValues; ++raw) {
    if (std::abs(model.depth_m(raw) - depth_m) < std::abs(model.depth_m(best) - depth_m)) best = raw;
  }
  return best;
}

constexpr double kFar_m = 0.63;

/// `camera` is a Kinect v1 but for its lens. `depthOf(column, row)`: `middle_m`, kFar_m, or negative for a
/// random raw value.
template <typename DepthOf>
TimedScene hard(const char* name, const rt::DepthModelParameters& camera, double middle_m, double radius_m,
                DepthOf depthOf) {
  constexpr int kTicks = 500;
  constexpr double kJump_m = 0.025;
  const rt::DepthModel model(camera, {});
  const std::uint16_t middle_raw = rawAt(model, middle_m);
  const std::uint16_t far_raw = rawAt(model, kFar_m);
  std::mt19937 random(1);
  const auto frame = std::make_shared<rt::DepthFrame>();
  for (int row = 0; row < drivers::kKinectHeight; ++row) {
    for (int column = 0; column < drivers::kKinectWidth; ++column) {
      const double depth_m = depthOf(column, row);
      const auto pixel = static_cast<std::size_t>(row * drivers::kKinectWidth + column);
      frame->raw[pixel] = depth_m < 0 ? static_cast<std::uint16_t>(random() % drivers::kKinectRawValues)
                          : depth_m == middle_m ? middle_raw
                                                : far_raw;
    }
  }
  TimedScene scene{name, camera, {frame}, {0, 0, -middle_m}, {0, 0, -1}};
  scene.path = touchingPath(scene.surface_m, scene.inward, kTicks, radius_m);
  std::uniform_real_distribution<double> jump_m(-kJump_m, kJump_m);
  for (int i = 0; i < kTicks; ++i) {
    scene.path.push_back(scene.surface_m + Vec3{jump_m(random), jump_m(random), jump_m(random)});
  }
  return scene;
}

}  // namespace

std::vector<TimedScene> hardFrames() {
  constexpr double kNear_m = 0.6;
  constexpr double kWall_m = 0.42;
  constexpr double kCircle_m = 0.02;
  rt::DepthModelParameters lens;
  lens.fx_px = lens.fy_px = 20000;
  const rt::DepthModelParameters kinect;
  std::vector<TimedScene> scenes;
  scenes.push_back(hard("all in one ball", lens, kNear_m, 0.005, [](int, int) { return kNear_m; }));
  scenes.push_back(hard("wall at 0.42 m", kinect, kWall_m, kCircle_m, [](int, int) { return kWall_m; }));
  scenes.push_back(hard("checkerboard", kinect, kNear_m, kCircle_m,
                        [](int column, int row) { return (column + row) % 2 == 0 ? kNear_m : kFar_m; }));
  scenes.push_back(hard("columns", kinect, kNear_m, kCircle_m,
                        [](int column, int) { return column % 2 == 0 ? kNear_m : kFar_m; }));
  scenes.push_back(hard("random", kinect, kNear_m, kCircle_m, [](int, int) { return -1.0; }));
  return scenes;
}

TimedScene scattered(TimedScene scene, int ticks) {
  constexpr double kOffset_m = 0.01;
  const rt::DepthModel model(scene.camera, {});
  std::mt19937 random(1);
  std::uniform_int_distribution<std::uint32_t> any_column(0,
                                                          static_cast<std::uint32_t>(model.width_px()) - 1);
  std::uniform_int_distribution<std::uint32_t> any_row(0, static_cast<std::uint32_t>(model.height_px()) - 1);
  const auto stride = static_cast<std::uint32_t>(model.stride_px());
  std::normal_distribution<double> offset_m(0, kOffset_m);
  scene.frames.resize(1);
  scene.unrelated = true;
  scene.path.clear();
  while (scene.path.size() < static_cast<std::size_t>(ticks)) {
    const std::uint32_t column = any_column(random);
    const std::uint32_t row = any_row(random);
    const std::uint16_t raw = scene.frames.front()->raw[row * stride + column];
    if (model.depth_m(raw) <= 0) continue;
    const Vec3 point = model.pointInWorld(rt::PackedPixel::pack(column, row, raw), raw);
    scene.path.push_back(point + Vec3{offset_m(random), offset_m(random), offset_m(random)});
  }
  return scene;
}

TimedScene fast(TimedScene scene, int ticks) {
  scene.path = touchingPath(scene.surface_m, scene.inward, ticks, kPathRadius_m, 1 / kPathSpeed_m_per_s);
  return scene;
}

}  // namespace hapticd::tools
