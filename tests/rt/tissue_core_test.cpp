// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <memory>
#include <numbers>
#include <random>

#include "rt/loop/haptic_core.h"
#include "tests/rt/core_rig.h"

namespace hapticd::test {
namespace {

using rt::Vec3;

/// Forces of the surface's model; it lies on the wall up to single precision.
constexpr double kSurface_n = 1e-4;

/// A core with a law with a proxy over a wall that has a stiffness map, and a HIP that is moved by hand.
class TissueCore : public testing::Test, protected CoreRig {
 protected:
  TissueCore() {
    directive.parameters.law = rt::ForceLaw::surface;
    directive.parameters.safety.contact_damping = rt::ContactDamping::off;
    directive.parameters.safety.stiffness_limit = rt::StiffnessLimit::off;
    directive.engage = true;
    directive.engage_inside = false;
    handle.position_m_in_world = wall.inFrontOfWall(0.005);
    tissue = map_.get();
  }

  rt::TissueRegion& addSphere(double x_m, double radius_m) {
    rt::TissueRegion& region = map_->regions[map_->count++];
    region = {};
    region.identity = ++last_identity_;
    region.shape.position_m_in_world = wall.inFrontOfWall(0) + Vec3{x_m, 0, 0};
    region.shape.radius_m = radius_m;
    ++map_->generation;
    return region;
  }

  rt::Tick step(const Vec3& velocity_m_per_s = {}) {
    handle.velocity_m_per_s_in_world = velocity_m_per_s;
    handle.position_m_in_world += kPeriod_s * velocity_m_per_s;
    return CoreRig::step();
  }
  rt::Tick steps(int count, const Vec3& velocity_m_per_s = {}) {
    rt::Tick tick;
    for (int i = 0; i < count; ++i) tick = step(velocity_m_per_s);
    return tick;
  }
  /// Engages in free space and then presses down to this depth.
  rt::Tick press(double depth_m) {
    steps(600);
    const double distance_m = handle.position_m_in_world.z - wall.inFrontOfWall(-depth_m).z;
    steps(100, {0, 0, -distance_m / 0.1});
    return steps(100);
  }

  std::unique_ptr<rt::TissueMap> map_ = std::make_unique<rt::TissueMap>();

 private:
  std::uint32_t last_identity_ = 0;
};

TEST_F(TissueCore, ExertsTheForceOfTheRegion) {
  rt::TissueRegion& region = addSphere(0, 0.02);
  region.stiffness_n_per_m = 300;
  const rt::Tick tick = press(0.004);
  EXPECT_NEAR(tick.law_force_n_in_world.z, 1.2, kSurface_n);
  EXPECT_NEAR(tick.command_force_n_in_world.z, 1.2, kSurface_n);
  EXPECT_EQ(tick.tissue_region, 0);
  EXPECT_EQ(tick.tissue_generation, map_->generation);
}

TEST_F(TissueCore, AlsoUnderTheLawProxy) {
  directive.parameters.law = rt::ForceLaw::proxy;
  addSphere(0, 0.02).stiffness_n_per_m = 300;
  EXPECT_NEAR(press(0.004).command_force_n_in_world.z, 1.2, kSurface_n);
}

TEST_F(TissueCore, ExertsTheSpringsOfTheLawBesideTheRegions) {
  addSphere(0.1, 0.02);
  const rt::Tick tick = press(0.004);
  EXPECT_NEAR(tick.command_force_n_in_world.z, 2, kSurface_n);
  EXPECT_EQ(tick.tissue_region, -1);
}

TEST_F(TissueCore, ChangesNothingWithoutRegions) {
  map_->generation = 7;
  for (const rt::ForceLaw law : {rt::ForceLaw::nearest_springs, rt::ForceLaw::proxy, rt::ForceLaw::surface}) {
    CoreRig rig;
    rig.directive.parameters.law = law;
    rig.directive.parameters.contact = {.friction = 0.3, .damping_n_s_per_m = 0.5};
    rig.directive.engage = true;
    CoreRig with_map;
    with_map.directive = rig.directive;
    with_map.tissue = map_.get();
    for (int i = 0; i < 2000; ++i) {
      const double angle = 0.005 * i;
      const Vec3 before = rig.handle.position_m_in_world;
      rig.handle.position_m_in_world =
          rig.wall.inFrontOfWall(0.004 * std::cos(angle)) + Vec3{0.01 * std::sin(2 * angle), 0, 0};
      rig.handle.velocity_m_per_s_in_world = 1000 * (rig.handle.position_m_in_world - before);
      with_map.handle = rig.handle;
      const rt::Tick without = rig.step();
      const rt::Tick with = with_map.step();
      ASSERT_EQ(with.command_force_n_in_world, without.command_force_n_in_world);
      ASSERT_EQ(with.energy_j, without.energy_j);
    }
  }
}

/// Keeps the largest change of the command per tick, with the HIP at rest.
class NoStep : public TissueCore {
 protected:
  void rest(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      const Vec3 now = step().command_force_n_in_world;
      largest_n_ = std::max(largest_n_, norm(now - before_));
      before_ = now;
    }
  }
  void begin(double depth_m) { before_ = press(depth_m).command_force_n_in_world; }
  /// The rate of a surface at the fastest speed that is allowed for.
  double allowed_n(double stiffness_n_per_m) const {
    return stiffness_n_per_m * rt::kFastestSurface_m_per_s * kPeriod_s;
  }

  Vec3 before_;
  double largest_n_ = 0;
};

TEST_F(NoStep, WhenARegionMoves) {
  rt::TissueRegion& region = addSphere(0.05, 0.02);
  region.stiffness_n_per_m = 900;
  begin(0.004);
  const double at_rest_n = before_.z;
  double most_n = 0;
  for (int i = 0; i < 60; ++i) {
    region.shape.position_m_in_world.x = i % 2 == 0 ? 0.0 : 0.05;
    ++map_->generation;
    rest(33);
    most_n = std::max(most_n, before_.z);
  }
  EXPECT_GT(most_n, at_rest_n + 0.5);
  EXPECT_LE(largest_n_, allowed_n(900) + 1e-9);
  EXPECT_GT(largest_n_, 0);
}

TEST_F(NoStep, WhenRegionsComeChangeAndGo) {
  rt::TissueRegion& first = addSphere(0, 0.02);
  first.stiffness_n_per_m = 800;
  begin(0.004);
  first.model = rt::ContactModel::hunt_crossley;
  ++map_->generation;
  rest(100);
  first.stiffness_n_per_m = 200;
  ++map_->generation;
  rest(1000);
  rt::TissueRegion& second = addSphere(0.01, 0.03);
  second.model = rt::ContactModel::layered;
  second.stiffness_n_per_m = 100;
  second.lower_stiffness_n_per_m = 3000;
  rest(100);
  map_->count = 1;
  ++map_->generation;
  rest(100);
  map_->count = 0;
  ++map_->generation;
  rest(100);
  EXPECT_NEAR(before_.z, 2, kSurface_n);
  EXPECT_LE(largest_n_, allowed_n(800) + 1e-9);
}

TEST_F(TissueCore, DoesNotStiffenBeforeTheContactEnds) {
  rt::TissueRegion& region = addSphere(0, 0.02);
  region.stiffness_n_per_m = 300;
  const double before_n = press(0.004).command_force_n_in_world.z;
  region.stiffness_n_per_m = 900;
  ++map_->generation;
  for (int i = 0; i < 2000; ++i) ASSERT_LE(step().command_force_n_in_world.z, before_n + 1e-9);
  steps(100, {0, 0, 0.1});
  EXPECT_NEAR(press(0.004).command_force_n_in_world.z, 3.6, kSurface_n);
}

// Coulomb's law: friction times the force along the normal.
TEST_F(TissueCore, SlidesWithTheFrictionOfTheRegion) {
  rt::TissueRegion& region = addSphere(0, 0.03);
  region.stiffness_n_per_m = 300;
  region.friction = 0.4;
  press(0.004);
  const rt::Tick first = steps(200, {0.05, 0, 0});
  EXPECT_NEAR(first.law_force_n_in_world.z, 1.2, kSurface_n);
  EXPECT_NEAR(first.law_force_n_in_world.x, -0.4 * 1.2, 0.01 * 0.4 * 1.2);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> speed_m_per_s(0.01, 0.3);
  std::uniform_real_distribution<double> angle(0, 2 * std::numbers::pi);
  for (int stroke = 0; stroke < 200; ++stroke) {
    const double from_m = 0.005;
    const Vec3 middle_m = wall.inFrontOfWall(-0.004);
    const Vec3 inwards = (1 / std::max(from_m, norm(middle_m - handle.position_m_in_world))) *
                         (middle_m - handle.position_m_in_world);
    const double towards = angle(random);
    const Vec3 direction = inwards + 0.3 * Vec3{std::cos(towards), std::sin(towards), 0};
    const Vec3 velocity = (speed_m_per_s(random) / norm(direction)) * direction;
    // the way on which friction holds the proxy, from the other end of it, and then a slide
    const int held = static_cast<int>(std::ceil(2 * 0.4 * 0.004 / (kPeriod_s * norm(velocity))));
    steps(held, velocity);
    for (int i = 0; i < 20; ++i) {
      const rt::Tick tick = step(velocity);
      constexpr double kBehind_m = 3e-6;  // what the law allows a proxy to be behind the surface
      ASSERT_NEAR(tick.law_force_n_in_world.z, 1.2, 300 * kBehind_m) << stroke;
      ASSERT_NEAR(std::hypot(tick.law_force_n_in_world.x, tick.law_force_n_in_world.y), 0.4 * 1.2,
                  0.01 * 0.4 * 1.2)
          << stroke << ", " << i;
    }
  }
}

TEST_F(TissueCore, DoesNotBlendWhatTheDisplacementExplains) {
  rt::TissueRegion& region = addSphere(0.02, 0.01);
  region.stiffness_n_per_m = 1500;
  press(0.002);
  for (int i = 0; i < 400; ++i) {
    const rt::Tick tick = step({0.1, 0, 0});
    ASSERT_FALSE(tick.blending) << i;
  }
}

// The hand leads the HIP along closed paths over the borders. A sampled spring gives energy; no more than the
// device's own damping takes may be left of it after each path.
TEST_F(TissueCore, GivesTheHandNoEnergyOnClosedPaths) {
  rt::TissueRegion& region = addSphere(0.01, 0.01);
  region.stiffness_n_per_m = 1200;
  directive.parameters.safety.max_force_n = 20;
  press(0.003);
  double given_j = 0;
  Vec3 before = handle.position_m_in_world;
  Vec3 force;
  constexpr int kTicks = 10'000;
  for (int i = 0; i < kTicks; ++i) {
    const double angle = 2 * std::numbers::pi * i * 0.001;
    const rt::Tick tick = step(2 * std::numbers::pi *
                               Vec3{0.01 * std::cos(angle), 0.01 * std::sin(angle), 0.002 * std::cos(angle)});
    const Vec3 motion_m = handle.position_m_in_world - before;
    given_j +=
        dot(force, motion_m) - start.handle.device_damping_n_s_per_m * dot(motion_m, motion_m) / kPeriod_s;
    before = handle.position_m_in_world;
    force = tick.command_force_n_in_world;
    if (i % 1000 == 999) {
      EXPECT_LE(given_j, 0) << i;
    }
  }
}

TEST_F(TissueCore, LimitsTheStiffnessByTheStiffestRegion) {
  directive.parameters.safety.stiffness_limit = rt::StiffnessLimit::reduce;
  handle.delay_s = 0.0095;  // b / lag = 4 N s/m / 10 ms = 400 N/m
  addSphere(0.1, 0.02).stiffness_n_per_m = 800;
  EXPECT_NEAR(press(0.004).stiffness_gain, 0.5, 1e-9);
}

/// Vibrates at 100 Hz with 0.2 N in the region.
class CueCore : public TissueCore {
 protected:
  CueCore() {
    rt::TissueRegion& region = addSphere(0, 0.03);
    region.cue_force_n = 0.2;
    region.cue_hz = 100;
  }
};

TEST_F(CueCore, VibratesAlongTheSurfaceWhileEngagedAndInContact) {
  EXPECT_EQ(steps(600).cue_force_n_in_world, Vec3{});
  press(0.004);
  std::complex<double> sum;
  constexpr int kTicks = 1000;
  for (int i = 0; i < kTicks; ++i) {
    const rt::Tick tick = step();
    ASSERT_NEAR(tick.cue_force_n_in_world.z, 0, 1e-6);
    ASSERT_LT(norm(tick.slewed_force_n_in_world - tick.filtered_force_n_in_world - tick.cue_force_n_in_world),
              1e-9);
    sum += tick.cue_force_n_in_world.x * std::polar(1.0, -2 * std::numbers::pi * 0.1 * i);
    sum += tick.cue_force_n_in_world.y * std::polar(1.0, -2 * std::numbers::pi * 0.1 * i);
  }
  EXPECT_NEAR(2 * std::abs(sum) / kTicks, 0.2, 0.05 * 0.2);
  steps(100, {0, 0, 0.1});
  EXPECT_EQ(steps(10).cue_force_n_in_world, Vec3{});
}

TEST_F(CueCore, IsSilentWhileNotEngaged) {
  press(0.004);
  directive.engage = false;
  for (int i = 0; i < 300; ++i) {
    const rt::Tick tick = step();
    if (tick.mode != rt::Mode::engaged) {
      ASSERT_EQ(tick.cue_force_n_in_world, Vec3{});
    }
  }
}

}  // namespace
}  // namespace hapticd::test
