// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "tests/rt/core_rig.h"

namespace hapticd::test {

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
