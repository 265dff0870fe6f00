// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include "rt/loop/haptic_core.h"
#include "tests/rt/core_rig.h"

namespace hapticd::test {
namespace {

using rt::Mode;
using rt::Vec3;

/// A few roundings of numbers of the size of the forces, and of a sum of some hundred periods.
constexpr double kRounding = 1e-12;

/// So high that the stage does not act.
constexpr double kNoLimit = 1e9;

TEST(HapticCoreForce, PushesAwayFromTheWallAndNotBeyondD_thresh) {
  CoreRig rig;
  const rt::Tick near = rig.step();
  EXPECT_GT(near.law_force_n_in_world.z, 0);
  EXPECT_GE(near.points_used, 10U);
  rig.handle.position_m_in_world = rig.wall.inFrontOfWall(0.041);
  const rt::Tick far = rig.step();
  EXPECT_EQ(far.law_force_n_in_world, Vec3{});
  EXPECT_EQ(far.points_used, 0U);
  EXPECT_FALSE(far.outside_model);
}

TEST(HapticCoreForce, RampsLinearlyAfterEngaging) {
  CoreRig rig;
  rig.directive.parameters.safety.max_slew_n_per_s = kNoLimit;
  rig.directive.parameters.safety.max_force_n = kNoLimit;
  rig.directive.engage = true;
  for (int tick = 1; tick <= 700; ++tick) {
    const rt::Tick out = rig.step();
    const double gain = std::min(1.0, tick * kPeriod_s / rig.directive.parameters.safety.engage_ramp_s);
    const Vec3 expected = gain * out.law_force_n_in_world;
    ASSERT_LE(norm(out.command_force_n_in_world - expected), kRounding * norm(out.law_force_n_in_world));
  }
}

TEST(HapticCoreForce, IsFullAtOnceWithoutARamp) {
  CoreRig rig;
  rig.directive.parameters.safety.max_slew_n_per_s = kNoLimit;
  rig.directive.parameters.safety.max_force_n = kNoLimit;
  rig.directive.parameters.safety.engage_ramp_s = 0;
  rig.directive.engage = true;
  const rt::Tick out = rig.step();
  EXPECT_EQ(out.command_force_n_in_world, out.law_force_n_in_world);
}

TEST(HapticCoreForce, RampsAgainAfterEachInterruption) {
  CoreRig rig;
  const double law_n = norm(rig.engageFully().blended_force_n_in_world);
  const double ramp_s = rig.directive.parameters.safety.engage_ramp_s;
  rig.directive.engage = false;
  rig.steps(100);
  rig.directive.engage = true;
  for (int tick = 1; tick <= 10; ++tick) {
    EXPECT_NEAR(norm(rig.step().command_force_n_in_world), law_n * tick * kPeriod_s / ramp_s,
                kRounding * law_n);
  }
}

TEST(HapticCoreForce, GoesToZeroAtTheSlewLimitWhenAnInputIsSpoiled) {
  CoreRig rig;
  rig.directive.parameters.safety.max_slew_n_per_s = 500;  // several ticks to zero
  const Vec3 full = rig.engageFully().command_force_n_in_world;
  rig.wall.scene.frame = 0;
  const double step_n = rig.directive.parameters.safety.max_slew_n_per_s * kPeriod_s;
  const int ticks_to_zero = static_cast<int>(std::ceil(norm(full) / step_n));
  ASSERT_GE(ticks_to_zero, 3);
  for (int tick = 1; tick < ticks_to_zero; ++tick) {
    EXPECT_NEAR(norm(rig.step().command_force_n_in_world), norm(full) - tick * step_n, kRounding);
  }
  EXPECT_EQ(rig.step().command_force_n_in_world, Vec3{});
}

TEST(HapticCoreForce, IsZeroThreeTicksAfterAFaultOfTheHandle) {
  CoreRig rig;
  const Vec3 full = rig.engageFully().command_force_n_in_world;
  rig.handle_fresh = false;
  rig.handle.time_ns = rig.now_ns - 11 * kPeriod_ns;
  for (int tick = 1; tick <= 3; ++tick) {
    const rt::Tick out = rig.step();
    EXPECT_TRUE(out.released);
    EXPECT_NEAR(norm(out.command_force_n_in_world), norm(full) * (3 - tick) / 3, kRounding);
  }
  EXPECT_EQ(rig.step().command_force_n_in_world, Vec3{});
}

TEST(HapticCoreForce, FadesLinearlyOnStaleDepth) {
  CoreRig rig;
  const Vec3 full = rig.engageFully().command_force_n_in_world;
  rig.scene_fresh = false;
  rig.wall.scene.frame_time_ns = rig.now_ns - 501 * kPeriod_ns;
  const int ticks = static_cast<int>(std::llround(rig.directive.parameters.safety.depth_ramp_s / kPeriod_s));
  for (int tick = 1; tick <= ticks; ++tick) {
    const double expected_n = norm(full) * (ticks - tick) / ticks;
    ASSERT_NEAR(norm(rig.step().command_force_n_in_world), expected_n, 1000 * kRounding);
  }
  EXPECT_EQ(rig.steps(2).command_force_n_in_world, Vec3{});
}

TEST(HapticCoreForce, IsScaledToTheHand) {
  CoreRig rig;
  rig.start.handle.force_scale = 0.5;
  const rt::Tick out = rig.engageFully();
  EXPECT_LT(norm(out.command_force_n_in_world - 0.5 * out.blended_force_n_in_world), kRounding);
}

// (b + B) / (T / 2 + t_d) with b = 4 N s/m, t_d = 19.5 ms: 200 N/m of 500.
TEST(HapticCoreForce, IsReducedToWhatTheHandlesDelayAllows) {
  for (const bool device_damps : {false, true}) {
    CoreRig rig;
    rig.handle.delay_s = 0.0195;
    rig.handle.damps = device_damps;
    if (!device_damps) rig.directive.parameters.safety.contact_damping = rt::ContactDamping::off;
    const rt::Tick out = rig.engageFully();
    EXPECT_NEAR(out.stiffness_limit_n_per_m, 200, 1e-9);
    EXPECT_NEAR(out.stiffness_gain, 0.4, kRounding);
    EXPECT_EQ(out.stiffness_rule, rt::StiffnessRule::delay);
    EXPECT_LT(norm(out.command_force_n_in_world - 0.4 * out.blended_force_n_in_world), kRounding);
    rig.directive.parameters.safety.stiffness_limit = rt::StiffnessLimit::warn;
    const rt::Tick warned = rig.steps(4000);
    EXPECT_EQ(warned.stiffness_gain, 1);
    EXPECT_NEAR(warned.stiffness_limit_n_per_m, 200, 1e-9);
  }
}

// 0.35 m / (T / 2 + t_d)^2 with 45 g and 9.5 ms: 157.5 N/m of 500.
TEST(HapticCoreForce, IsReducedToWhatTheDevicesMassAllowsWhereTheBoxDamps) {
  CoreRig rig;
  rig.handle.delay_s = 0.0095;
  const rt::Tick out = rig.engageFully();
  EXPECT_NEAR(out.stiffness_limit_n_per_m, 157.5, 1e-9);
  EXPECT_NEAR(out.stiffness_gain, 0.315, kRounding);
  EXPECT_EQ(out.stiffness_rule, rt::StiffnessRule::mass);
  EXPECT_NEAR(out.contact_damping_n_s_per_m, 1.75 * 157.5 * 0.01, 1e-9);
  rig.start.device_mass_kg = 0.2;  // limit 700 N/m
  const rt::Tick heavy = rig.steps(4000);
  EXPECT_EQ(heavy.stiffness_gain, 1);
  EXPECT_EQ(heavy.stiffness_rule, rt::StiffnessRule::none);
  EXPECT_NEAR(heavy.contact_damping_n_s_per_m, 1.75 * 500 * 0.01, 1e-9);
}

// Applies to all laws; the rig uses the paper's law. 1.75 * 100 N/m * 2.5 ms = 0.4375 N s/m.
TEST(HapticCoreForce, IsDampedOnceAsTheLagRequiresByBoxOrDevice) {
  CoreRig rig;
  rig.handle.delay_s = 0.002;
  rig.directive.parameters.force.stiffness_n_per_m = 100;  // below the force limit
  const Vec3 still = rig.engageFully().command_force_n_in_world;
  const Vec3 outwards = (1 / norm(still)) * still;
  rig.handle.velocity_m_per_s_in_world = -0.1 * outwards;
  const rt::Tick box = rig.steps(5);
  EXPECT_NEAR(norm(box.command_force_n_in_world), norm(still) + 0.04375, kRounding);
  EXPECT_EQ(box.law_force_n_in_world, box.blended_force_n_in_world) << "the law's force is the law's";
  rig.handle.damps = true;
  const rt::Tick device = rig.steps(5);
  EXPECT_NEAR(norm(device.command_force_n_in_world), norm(still), kRounding);
  EXPECT_NEAR(device.contact_damping_n_s_per_m, 0.4375, 1e-9) << "for the device to bring in";
  rig.handle.damps = false;
  rig.directive.parameters.safety.contact_damping = rt::ContactDamping::off;
  EXPECT_NEAR(norm(rig.steps(5).command_force_n_in_world), norm(still), kRounding);
}

TEST(HapticCoreForce, IsHeldOutsideTheModelFor10MillisecondsAtMost) {
  CoreRig rig;
  const Vec3 full = rig.engageFully().command_force_n_in_world;
  rig.handle.position_m_in_world = rig.wall.besideModel();
  int held = 0;
  rt::Tick tick = rig.step();
  for (; tick.command_force_n_in_world == full && held < 1'000; ++held) tick = rig.step();
  EXPECT_LE(held, 10);
  EXPECT_GE(held, 9) << "of 10 periods one may be lost to rounding";
  tick = rig.steps(100);
  EXPECT_TRUE(tick.outside_model);
  EXPECT_EQ(tick.mode, Mode::engaged);
  EXPECT_EQ(tick.command_force_n_in_world, Vec3{});
}

// From tick to tick the search may find the same points in another order, which changes the force by the
// rounding of its sum (SearchMemory).
TEST(HapticCoreForce, IsTheLawsAgainOnceTheModelHasCaughtUp) {
  CoreRig rig;
  const Vec3 full = rig.engageFully().command_force_n_in_world;
  for (int round = 0; round < 3; ++round) {
    rig.handle.position_m_in_world = rig.wall.besideModel();
    EXPECT_LT(norm(rig.steps(5).command_force_n_in_world - full), kRounding)
        << "a new hold of 10 ms each time";
    rig.handle.position_m_in_world = rig.wall.inFrontOfWall(0.02);
    const rt::Tick back = rig.step();
    EXPECT_FALSE(back.outside_model);
    EXPECT_LT(norm(back.command_force_n_in_world - full), kRounding);
  }
}

TEST(HapticCoreForce, HoldsNoForceFromBeforeAFault) {
  CoreRig rig;
  rig.engageFully();
  rig.directive.parameters.force.stiffness_n_per_m = std::numeric_limits<double>::infinity();
  ASSERT_EQ(rig.step().mode, Mode::faulted);
  rig.directive.parameters.force.stiffness_n_per_m = 500;
  rig.handle.position_m_in_world = rig.wall.besideModel();
  rig.directive.engage = false;
  rig.step();
  rig.directive.engage = true;  // within the 10 ms for which the last force is held
  EXPECT_EQ(rig.step().mode, Mode::engaged);
  EXPECT_EQ(rig.steps(100).command_force_n_in_world, Vec3{});
}

/// Randomly spoils and restores inputs and changes every parameter.
class Chaos {
 public:
  explicit Chaos(std::uint32_t seed) : random_(seed) {}

  void stir(CoreRig& rig) {
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    rt::LiveParameters& live = rig.directive.parameters;
    if (chance(0.1)) rig.handle.position_m_in_world = rig.wall.inFrontOfWall(between(-0.1, 0.1));
    if (chance(0.1)) rig.handle.position_m_in_world.x = between(-0.3, 0.3);
    if (chance(0.02)) rig.handle.position_m_in_world.y = kNaN;
    if (chance(0.02)) rig.handle.position_m_in_world = {between(-20, 20), 0, between(-20, 20)};
    if (chance(0.05)) rig.directive.engage = !rig.directive.engage;
    if (chance(0.5)) rig.directive.engage = true;
    if (chance(0.02)) rig.handle_fresh = !rig.handle_fresh;
    if (chance(0.02)) rig.scene_fresh = !rig.scene_fresh;
    if (chance(0.02)) rig.wall.scene.frame = 1 - rig.wall.scene.frame;
    if (chance(0.02)) live.force.radius_m = between(0.005, 0.1);
    if (chance(0.02)) live.force.max_points = static_cast<int>(between(10, 1'000));
    if (chance(0.02)) live.force.stiffness_n_per_m = std::exp(between(0, 12));
    if (chance(0.005)) live.force.stiffness_n_per_m = chance(0.5) ? kNaN : 1e308;
    if (chance(0.02)) live.safety.max_force_n = between(0.1, 40);
    if (chance(0.02)) live.safety.max_slew_n_per_s = between(1, 5'000);
    if (chance(0.02)) live.safety.engage_ramp_s = between(0, 0.1);
  }

 private:
  bool chance(double probability) { return std::bernoulli_distribution(probability)(random_); }
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  std::mt19937_64 random_;
};

TEST(HapticCoreForce, IsFiniteLimitedAndSlewedWhateverHappens) {
  int engaged = 0;
  int faulted = 0;
  for (std::uint32_t seed = 0; seed < 10 && !testing::Test::HasFailure(); ++seed) {
    CoreRig rig;
    Chaos chaos(seed);
    Vec3 before;
    double released_from_n = 0;
    for (int i = 0; i < 5'000; ++i) {
      chaos.stir(rig);
      const rt::Tick tick = rig.step();
      const rt::SafetyParameters& safety = rig.directive.parameters.safety;
      const Vec3& after = tick.command_force_n_in_world;
      const double largest_n = std::max(safety.max_force_n, norm(before));
      ASSERT_TRUE(isFinite(after));
      ASSERT_LE(norm(after), largest_n * (1 + kRounding));
      if (!tick.released) released_from_n = norm(after);
      const double step_n = tick.released ? released_from_n / rt::SafetyChain::kReleaseTicks
                                          : safety.max_slew_n_per_s * kPeriod_s;
      ASSERT_LE(norm(after - before), step_n * (1 + kRounding) + kRounding * largest_n);
      before = after;
      engaged += tick.mode == Mode::engaged ? 1 : 0;
      faulted += tick.mode == Mode::faulted ? 1 : 0;
    }
  }
  EXPECT_GT(engaged, 1'000) << "otherwise nothing was tried";
  EXPECT_GT(faulted, 100) << "otherwise nothing was tried";
}

}  // namespace
}  // namespace hapticd::test
