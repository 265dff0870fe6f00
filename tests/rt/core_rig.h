// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "rt/loop/haptic_core.h"
#include "rt/loop/loop_state.h"
#include "tests/rt/small_scene.h"

namespace hapticd::test {

inline constexpr double kPeriod_s = 0.001;
inline constexpr std::int64_t kPeriod_ns = 1'000'000;

/// A HapticCore with valid inputs until a test makes them invalid, and simulated time. The HIP starts 2 cm in
/// front of a wall, where the springs of the paper's law are half compressed.
class CoreRig {
 public:
  CoreRig() {
    handle.sequence = 1;
    handle.position_m_in_world = wall.inFrontOfWall(0.02);
    directive.engage_inside = true;
  }

  /// Advances by one period. Measurements marked as `fresh` are renewed.
  rt::Tick step() {
    now_ns += kPeriod_ns;
    if (handle_fresh) handle.time_ns = now_ns;
    if (scene_fresh) wall.scene.frame_time_ns = now_ns;
    return core.step({.now_ns = now_ns,
                      .period_s = kPeriod_s,
                      .scene = wall.scene,
                      .handle = handle,
                      .directive = directive,
                      .start = start,
                      .overran = overran,
                      .fixtures = fixtures,
                      .poses = poses});
  }
  rt::Tick steps(int count) {
    rt::Tick tick;
    for (int i = 0; i < count; ++i) tick = step();
    return tick;
  }
  /// Engages and waits until the ramp has ended and the force is constant.
  rt::Tick engageFully() {
    directive.engage = true;
    return steps(600);
  }

  SmallScene wall;
  rt::HapticCore core{wall.pointCapacity()};
  rt::HandleState handle;
  rt::Directive directive;
  rt::StartParameters start;
  const rt::FixtureSet* fixtures = nullptr;
  std::vector<rt::FramePose> poses;  ///< that arrive with the next tick, and each one after it
  bool handle_fresh = true;
  bool scene_fresh = true;
  bool overran = false;
  std::int64_t now_ns = 5'000'000'000;
};

}  // namespace hapticd::test
