// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
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
                      .tissue = tissue,
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
  const rt::TissueMap* tissue = nullptr;
  std::vector<rt::FramePose> poses;  ///< that arrive with the next tick, and each one after it
  bool handle_fresh = true;
  bool scene_fresh = true;
  bool overran = false;
  std::int64_t now_ns = 5'000'000'000;
};

/// A core far in front of its wall, with fixtures around `origin`.
class FixtureCore {
 public:
  static constexpr double kStiffness = 300;

  FixtureCore() {
    rig.fixtures = set.get();
    rig.directive.parameters.safety.max_slew_n_per_s = 20'000;
    rig.directive.parameters.force.stiffness_n_per_m = 1000;
    origin = rig.wall.inFrontOfWall(0.3);
    rig.handle.position_m_in_world = origin;
  }
  rt::Fixture& add(rt::FixtureKind kind, rt::Shape shape) {
    rt::Fixture& fixture = set->fixtures[set->count++];
    fixture = {};
    shape.position_m_in_world += origin;
    fixture.kind = kind;
    fixture.shape = shape;
    fixture.identity = set->count;
    fixture.stiffness_n_per_m = kStiffness;
    fixture.damping_n_s_per_m = 0;
    fixture.max_force_n = 10;
    fixture.fade_in_s = 0.2;
    redefine(fixture);
    return fixture;
  }
  void redefine(rt::Fixture& fixture) {
    fixture.definition = ++definitions_;
    ++set->generation;
  }
  /// One tick with the HIP at `origin + offset`.
  rt::Tick at(const rt::Vec3& offset_m) {
    return at(offset_m, (1 / kPeriod_s) * (origin + offset_m - rig.handle.position_m_in_world));
  }
  rt::Tick at(const rt::Vec3& offset_m, const rt::Vec3& velocity_m_per_s) {
    rig.handle.velocity_m_per_s_in_world = velocity_m_per_s;
    rig.handle.position_m_in_world = origin + offset_m;
    ++rig.handle.sequence;
    return rig.step();
  }
  void engage(const rt::Vec3& offset_m) {
    rig.directive.engage = true;
    for (int i = 0; i < 600; ++i) at(offset_m);
  }

  CoreRig rig;
  std::unique_ptr<rt::FixtureSet> set = std::make_unique<rt::FixtureSet>();
  rt::Vec3 origin;

 private:
  std::uint64_t definitions_ = 0;
};

inline rt::Shape sphere(double radius_m, const rt::Vec3& centre = {}) {
  rt::Shape shape{.kind = rt::ShapeKind::sphere, .position_m_in_world = centre};
  shape.radius_m = radius_m;
  return shape;
}
inline rt::Shape floor(double z = 0) {
  return {.kind = rt::ShapeKind::plane, .position_m_in_world = {0, 0, z}};
}

}  // namespace hapticd::test
