// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "rt/base/parameters.h"
#include "rt/depth/depth_frame.h"
#include "rt/laws/law_table.h"
#include "rt/loop/haptic_core.h"
#include "tools/lib/offline/offline_box.h"
#include "tools/lib/truth/true_scene.h"

namespace hapticd::test {

inline constexpr double kTick_s = 0.001;
inline constexpr int kTicksPerFrame = 33;
inline constexpr double kFrame_s = kTick_s * kTicksPerFrame;

/// A box without threads in front of an exact scene, with limits so high that only the law acts. Frames
/// arrive every 33rd tick of 1 ms.
class HardRig {
 public:
  explicit HardRig(rt::ForceLaw law, const rt::DepthModelParameters& depth_model = {},
                   const rt::GridParameters& grid = {});

  /// Shows a frame; `fill` writes its raw values.
  void show(const std::function<void(rt::DepthFrame&)>& fill);
  /// Shows `scene` at the time `t_s`, by default without noise.
  void show(tools::TrueScene& scene, double t_s = 0, tools::SceneNoise noise = tools::SceneNoise::none);
  void showConstant(std::uint16_t raw);

  rt::Tick tick(const rt::Vec3& hip_m_in_world) { return box.tick(hip_m_in_world, kTick_s); }
  /// Moves straight to `to_m_in_world`, `step_m` per tick; returns the last tick.
  rt::Tick moveTo(const rt::Vec3& to_m_in_world, double step_m = 0.001);
  /// Places the HIP without moving it there.
  void jumpTo(const rt::Vec3& hip_m_in_world) { hip_ = hip_m_in_world; }
  const rt::Vec3& hip() const { return hip_; }

  double stiffness_n_per_m() { return box.parameters().force.stiffness_n_per_m; }

  tools::OfflineBox box;

 private:
  rt::Vec3 hip_;
  std::unique_ptr<rt::DepthFrame> frame_ = std::make_unique<rt::DepthFrame>();
};

/// Returns a camera with fine raw units around `distance_m`, so that rounding is negligible.
rt::DepthModelParameters fineCameraFor(double distance_m);

/// Runs a test for each law.
class EachLaw : public testing::TestWithParam<rt::ForceLaw> {};
/// Runs a test for each law with a proxy.
class EachConstraint : public testing::TestWithParam<rt::ForceLaw> {};

}  // namespace hapticd::test
