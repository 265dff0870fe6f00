// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "rt/depth_frame.h"
#include "rt/haptic_core.h"
#include "rt/law_table.h"
#include "rt/parameters.h"
#include "tools/offline/offline_box.h"
#include "tools/truth/true_scene.h"

namespace hapticd::test {

inline constexpr double kTick_s = 0.001;
inline constexpr int kTicksPerFrame = 33;
inline constexpr double kFrame_s = kTick_s * kTicksPerFrame;

/// A box without threads whose limits are far away, so that the law itself is seen, in front of a true scene.
/// Frames come every 33rd tick of 1 ms.
class HardRig {
 public:
  explicit HardRig(rt::ForceLaw law, const rt::DepthModelParameters& depth_model = {},
                   const rt::GridParameters& grid = {});

  /// Shows a frame; `fill` writes its raw values.
  void show(const std::function<void(rt::DepthFrame&)>& fill);
  /// Shows `scene` as it is at `t_s`, without noise unless asked for.
  void show(tools::TrueScene& scene, double t_s = 0, tools::SceneNoise noise = tools::SceneNoise::none);
  void showConstant(std::uint16_t raw);

  rt::Tick tick(const rt::Vec3& hip_m_in_world) { return box.tick(hip_m_in_world, kTick_s); }
  /// Straight to `to` from where the HIP is, `step_m` per tick; the last tick.
  rt::Tick moveTo(const rt::Vec3& to_m_in_world, double step_m = 0.001);
  /// Places the HIP there without a way in between.
  void jumpTo(const rt::Vec3& hip_m_in_world) { hip_ = hip_m_in_world; }
  const rt::Vec3& hip() const { return hip_; }

  double stiffness_n_per_m() { return box.parameters().springs.stiffness_n_per_m; }

  tools::OfflineBox box;

 private:
  rt::Vec3 hip_;
  std::unique_ptr<rt::DepthFrame> frame_ = std::make_unique<rt::DepthFrame>();
};

/// A camera of fine units around `distance_m`, so that a true scene is seen without noticeable rounding.
rt::DepthModelParameters fineCameraFor(double distance_m);

/// Runs for each law.
class EachLaw : public testing::TestWithParam<rt::ForceLaw> {};
/// Runs for the laws with a proxy.
class EachConstraint : public testing::TestWithParam<rt::ForceLaw> {};

}  // namespace hapticd::test
