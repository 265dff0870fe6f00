// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include "rt/fixtures/fixture_forces.h"
#include "rt/fixtures/fixture_path.h"

namespace hapticd::test {

/// Fixtures in empty space: no scene, no law, and no damping unless a test asks for it.
class FixtureRig {
 public:
  static constexpr double kTick_s = 0.001;

  FixtureRig() { parameters.springs.stiffness_n_per_m = 3000; }

  /// Adds a fixture without damping, saturation or fading; returns its place in the set.
  std::size_t add(rt::FixtureKind kind, const rt::Shape& shape, double stiffness_n_per_m = 300) {
    rt::Fixture& fixture = set->fixtures[set->count];
    fixture = {};
    fixture.kind = kind;
    fixture.shape = shape;
    fixture.stiffness_n_per_m = stiffness_n_per_m;
    fixture.damping_n_s_per_m = 0;
    fixture.max_force_n = 1000;
    fixture.fade_in_s = 0;
    fixture.identity = ++identities_;
    redefine(set->count);
    return set->count++;
  }
  std::size_t addPath(const std::vector<rt::Vec3>& points_m, double bend_radius_m, double stiffness_n_per_m) {
    const std::size_t index = add(rt::FixtureKind::path, {}, stiffness_n_per_m);
    rt::Fixture& path = set->fixtures[index];
    path.first_element = elements_;
    path.element_count = static_cast<std::uint32_t>(
        rt::smoothPath(points_m, bend_radius_m, std::span(set->elements).subspan(elements_)));
    elements_ += path.element_count;
    return index;
  }
  rt::Fixture& operator[](std::size_t index) { return set->fixtures[index]; }
  /// Marks a fixture as changed.
  void redefine(std::size_t index) {
    set->fixtures[index].definition = ++definitions_;
    ++set->generation;
  }

  /// One tick with the HIP at a place.
  rt::FixtureForces::Output tick(const rt::Vec3& hip_m) {
    const rt::Vec3 velocity = placed_ ? (1 / kTick_s) * (hip_m - hip_) : rt::Vec3{};
    hip_ = hip_m;
    placed_ = true;
    return forces.step({.set = *set,
                        .scene = scene,
                        .hip_m_in_world = hip_m,
                        .velocity_m_per_s_in_world = velocity,
                        .parameters = parameters,
                        .law = law,
                        .surface_law = surface_law,
                        .period_s = kTick_s});
  }
  /// Moves the HIP straight to a place, at most `step_m` in each tick.
  rt::FixtureForces::Output moveTo(const rt::Vec3& to_m, double step_m = 0.001) {
    rt::FixtureForces::Output output;
    while (!(hip_ == to_m)) {
      const rt::Vec3 left = to_m - hip_;
      const double length = norm(left);
      output = tick(length <= step_m ? to_m : hip_ + (step_m / length) * left);
    }
    return output;
  }
  void jumpTo(const rt::Vec3& hip_m) {
    forces.release();
    hip_ = hip_m;
    tick(hip_m);
  }

  std::unique_ptr<rt::FixtureSet> set = std::make_unique<rt::FixtureSet>();
  rt::LiveParameters parameters;
  rt::Scene scene;
  rt::ForceSample law;
  bool surface_law = false;
  rt::FixtureForces forces;

 private:
  rt::Vec3 hip_;
  bool placed_ = false;
  std::uint64_t definitions_ = 0;
  std::uint32_t identities_ = 0;
  std::uint32_t elements_ = 0;
};

/// Random places, directions and shapes, reproducible.
class RandomShapes {
 public:
  explicit RandomShapes(unsigned seed) : engine_(seed) {}

  double between(double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(engine_);
  }
  rt::Vec3 place(double half_edge_m) {
    const double x = between(-half_edge_m, half_edge_m);
    const double y = between(-half_edge_m, half_edge_m);
    return {x, y, between(-half_edge_m, half_edge_m)};
  }
  rt::Vec3 direction() {
    for (;;) {
      const rt::Vec3 v = place(1);
      const double length = norm(v);
      if (length > 0.1 && length < 1) return (1 / length) * v;
    }
  }
  /// Any rotation, as columns x, y, z in rows.
  std::array<double, 9> rotation() {
    const rt::Vec3 x = direction();
    rt::Vec3 y = cross(x, direction());
    y = (1 / norm(y)) * y;
    const rt::Vec3 z = cross(x, y);
    return {x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z};
  }

 private:
  std::mt19937 engine_;
};

}  // namespace hapticd::test
