// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "rt/loop/haptic_core.h"
#include "tests/rt/core_rig.h"

namespace hapticd::test {
namespace {

using rt::Cause;
using rt::Mode;
using rt::Vec3;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// An invalid input, and the mode and cause that it must lead to while it lasts.
struct Spoiled {
  std::string name;
  std::function<void(CoreRig&)> spoil;
  Cause cause;
};

void moveHandleTo(CoreRig& rig, const Vec3& position) {
  rig.handle.position_m_in_world = position;
}
std::function<void(CoreRig&)> handleAt(const Vec3& position) {
  return [position](CoreRig& rig) { moveHandleTo(rig, position); };
}

const std::vector<Spoiled>& spoiledInputs() {
  static const std::vector<Spoiled> all{
      {"no measurement of the handle yet", [](CoreRig& rig) { rig.handle.sequence = 0; },
       Cause::handle_stale},
      {"a handle that fell silent",
       [](CoreRig& rig) {
         rig.handle_fresh = false;
         rig.handle.time_ns = rig.now_ns - 11 * kPeriod_ns;
       },
       Cause::handle_stale},
      {"x not a number", handleAt({kNaN, 0, 0}), Cause::handle_invalid},
      {"y infinite", handleAt({0, -kInfinity, 0}), Cause::handle_invalid},
      {"z beyond 10 m", handleAt({0, 0, 10.0001}), Cause::handle_invalid},
      {"z beyond -10 m", handleAt({0, 0, -10.0001}), Cause::handle_invalid},
      {"all huge", handleAt({1e308, -1e308, 1e308}), Cause::handle_invalid},
      {"no depth frame yet", [](CoreRig& rig) { rig.wall.scene.frame = 0; }, Cause::no_scene},
      {"a camera that fell silent",
       [](CoreRig& rig) {
         rig.scene_fresh = false;
         rig.wall.scene.frame_time_ns = rig.now_ns - 501 * kPeriod_ns;
       },
       Cause::depth_stale},
  };
  return all;
}

/// Restores valid inputs, including those that `spoil` did not change.
void makeGood(CoreRig& rig) {
  rig.handle.sequence = 1;
  rig.handle_fresh = true;
  rig.handle.position_m_in_world = rig.wall.inFrontOfWall(0.02);
  rig.wall.scene.frame = 1;
  rig.scene_fresh = true;
}

void expectMode(const rt::Tick& tick, Mode mode, Cause cause) {
  EXPECT_EQ(tick.mode, mode);
  EXPECT_EQ(tick.cause, cause);
}

TEST(HapticCoreMode, IsIdleUntilEngaged) {
  CoreRig rig;
  for (int i = 0; i < 100; ++i) {
    const rt::Tick tick = rig.step();
    expectMode(tick, Mode::idle, Cause::none);
    EXPECT_EQ(tick.command_force_n_in_world, Vec3{});
    EXPECT_GT(norm(tick.law_force_n_in_world), 0) << "the law is evaluated before engaging";
    EXPECT_GT(tick.points_used, 0U);
  }
}

TEST(HapticCoreMode, EngagesWithGoodInputsOnRequest) {
  CoreRig rig;
  rig.step();
  rig.directive.engage = true;
  expectMode(rig.step(), Mode::engaged, Cause::requested);
  EXPECT_GT(norm(rig.engageFully().command_force_n_in_world), 0);
}

TEST(HapticCoreMode, DisengagesOnRequestAndGoesToZero) {
  CoreRig rig;
  rig.engageFully();
  rig.directive.engage = false;
  expectMode(rig.step(), Mode::idle, Cause::requested);
  const rt::Tick later = rig.steps(100);
  expectMode(later, Mode::idle, Cause::requested);
  EXPECT_EQ(later.command_force_n_in_world, Vec3{});
}

TEST(HapticCoreMode, HoldsWithEachCauseAndRecoversByItself) {
  for (const Spoiled& input : spoiledInputs()) {
    SCOPED_TRACE(input.name);
    CoreRig rig;
    const Vec3 before = rig.engageFully().command_force_n_in_world;
    ASSERT_GT(norm(before), 1);

    input.spoil(rig);
    expectMode(rig.step(), Mode::holding, input.cause);
    EXPECT_EQ(rig.steps(250).command_force_n_in_world, Vec3{}) << "the longest fall takes 200 ms";
    expectMode(rig.step(), Mode::holding, input.cause);

    makeGood(rig);
    expectMode(rig.step(), Mode::engaged, Cause::requested);
    for (int i = 0; i < 600; ++i) {
      ASSERT_EQ(rig.step().command_force_n_in_world, Vec3{}) << "the HIP has entered without a force";
    }
    const Vec3 place = rig.wall.inFrontOfWall(0.02);
    for (const double to_m : {0.06, 0.02}) {
      const Vec3 from = rig.handle.position_m_in_world;
      for (int i = 1; i <= 400; ++i) {
        rig.handle.position_m_in_world = from + (i / 400.0) * (rig.wall.inFrontOfWall(to_m) - from);
        rig.step();
      }
    }
    rig.handle.position_m_in_world = place;
    constexpr double kRounding_n = 1e-12;  // another order of operations leads to the same force
    EXPECT_LT(norm(rig.steps(600).command_force_n_in_world - before), kRounding_n);
  }
}

TEST(HapticCoreMode, HoldsWhenItIsEngagedOnSpoiledInputs) {
  for (const Spoiled& input : spoiledInputs()) {
    SCOPED_TRACE(input.name);
    CoreRig rig;
    input.spoil(rig);
    rig.step();
    rig.directive.engage = true;
    const rt::Tick tick = rig.step();
    expectMode(tick, Mode::holding, input.cause);
    EXPECT_EQ(tick.command_force_n_in_world, Vec3{});
  }
}

TEST(HapticCoreMode, StaysIdleOnSpoiledInputs) {
  for (const Spoiled& input : spoiledInputs()) {
    SCOPED_TRACE(input.name);
    CoreRig rig;
    input.spoil(rig);
    const rt::Tick tick = rig.steps(20);
    EXPECT_EQ(tick.mode, Mode::idle);
    if (input.cause != Cause::depth_stale) {
      EXPECT_EQ(tick.law_force_n_in_world, Vec3{});
    }
    EXPECT_EQ(tick.command_force_n_in_world, Vec3{});
  }
}

TEST(HapticCoreMode, HoldsWithAnyTwoInvalidInputs) {
  for (const Spoiled& one : spoiledInputs()) {
    for (const Spoiled& other : spoiledInputs()) {
      CoreRig rig;
      rig.engageFully();
      one.spoil(rig);
      other.spoil(rig);
      const rt::Tick tick = rig.step();
      EXPECT_EQ(tick.mode, Mode::holding) << one.name << " and " << other.name;
      EXPECT_TRUE(tick.cause == one.cause || tick.cause == other.cause) << one.name << " and " << other.name;
    }
  }
}

TEST(HapticCoreMode, TreatsAMeasurementAsStaleOnceItIsOlderThanItsTimeout) {
  CoreRig rig;
  rig.engageFully();
  rig.handle_fresh = false;  // 0 ms old now; the timeout is 10 ms
  expectMode(rig.steps(10), Mode::engaged, Cause::requested);
  expectMode(rig.step(), Mode::holding, Cause::handle_stale);
  rig.handle_fresh = true;
  expectMode(rig.step(), Mode::engaged, Cause::requested);
  rig.scene_fresh = false;  // the timeout is 500 ms
  expectMode(rig.steps(500), Mode::engaged, Cause::requested);
  expectMode(rig.step(), Mode::holding, Cause::depth_stale);
}

TEST(HapticCoreMode, AcceptsTheWholeWorkspace) {
  CoreRig rig;
  rig.directive.engage = true;
  rig.directive.parameters.safety.max_handle_speed_m_per_s = 0;
  for (const double edge : {-10.0, 10.0}) {
    moveHandleTo(rig, {edge, edge, edge});
    expectMode(rig.step(), Mode::engaged, Cause::requested);
  }
}

class FaultedCore : public testing::Test {
 protected:
  FaultedCore() {
    rig.engageFully();
    rig.directive.parameters.force.stiffness_n_per_m = kInfinity;
    fault = rig.step();
    rig.directive.parameters.force.stiffness_n_per_m = 500;
  }
  CoreRig rig;
  rt::Tick fault;
};

TEST_F(FaultedCore, HasTheCauseForceNotFinite) {
  expectMode(fault, Mode::faulted, Cause::force_not_finite);
  EXPECT_TRUE(fault.not_finite);
  EXPECT_TRUE(isFinite(fault.command_force_n_in_world));
}

TEST_F(FaultedCore, GoesToZeroAndStaysThereAfterInputsRecover) {
  const rt::Tick tick = rig.steps(1'000);
  expectMode(tick, Mode::faulted, Cause::force_not_finite);
  EXPECT_EQ(tick.command_force_n_in_world, Vec3{});
}

TEST_F(FaultedCore, StaysFaultedThroughEverySpoiledInput) {
  for (const Spoiled& input : spoiledInputs()) {
    input.spoil(rig);
    expectMode(rig.step(), Mode::faulted, Cause::force_not_finite);
    makeGood(rig);
    expectMode(rig.step(), Mode::faulted, Cause::force_not_finite);
  }
}

TEST_F(FaultedCore, IsClearedByDisengagingAndEngagesAgain) {
  rig.steps(100);
  rig.directive.engage = false;
  expectMode(rig.step(), Mode::idle, Cause::requested);
  rig.directive.engage = true;
  expectMode(rig.step(), Mode::engaged, Cause::requested);
  EXPECT_GT(norm(rig.steps(600).command_force_n_in_world), 1);
}

TEST(HapticCoreMode, RefusesToEngageInContactUnlessRequested) {
  CoreRig rig;
  rig.directive.engage_inside = false;
  rig.step();
  rig.directive.engage = true;
  rig.directive.engage_request = 1;
  expectMode(rig.step(), Mode::idle, Cause::inside_surface);
  moveHandleTo(rig, rig.wall.inFrontOfWall(0.03));
  expectMode(rig.steps(10), Mode::idle, Cause::inside_surface);  // a refused request stays refused
  rig.directive.engage_request = 2;
  rig.directive.engage_inside = true;
  expectMode(rig.step(), Mode::engaged, Cause::requested);
}

TEST(HapticCoreMode, AHandleInANewSessionEngagesOnRequestOnly) {
  CoreRig rig;
  rig.handle.session = 1;
  rig.directive.engage_request = 1;
  rig.engageFully();
  rig.handle.session = 2;
  ++rig.handle.sequence;
  expectMode(rig.step(), Mode::idle, Cause::handle_replaced);
  const rt::Tick later = rig.steps(100);
  expectMode(later, Mode::idle, Cause::handle_replaced);
  EXPECT_EQ(later.command_force_n_in_world, Vec3{});
  rig.directive.engage_request = 2;
  expectMode(rig.step(), Mode::engaged, Cause::requested);
}

TEST(HapticCoreMode, HoldsWhileTheHandleIsClutchedOrNotCalibrated) {
  for (const auto& [condition, cause] :
       {std::pair{rt::HandleCondition::clutched, Cause::handle_clutched},
        std::pair{rt::HandleCondition::not_calibrated, Cause::handle_not_calibrated}}) {
    CoreRig rig;
    rig.engageFully();
    rig.handle.condition = condition;
    expectMode(rig.step(), Mode::holding, cause);
    EXPECT_EQ(rig.steps(100).command_force_n_in_world, Vec3{});
    rig.handle.condition = rt::HandleCondition::ready;
    expectMode(rig.step(), Mode::engaged, Cause::requested);
  }
}

// 5 m/s and 1 cm of tolerance: 1.5 cm within a tick.
TEST(HapticCoreMode, IgnoresAHandleForATenthOfASecondAfterAnImpossibleJump) {
  CoreRig rig;
  rig.directive.parameters.force.stiffness_n_per_m = 10;  // so that the jumps give the hand little energy
  rig.engageFully();
  const auto moveTo = [&](double front_m) {
    moveHandleTo(rig, rig.wall.inFrontOfWall(front_m));
    ++rig.handle.sequence;
    return rig.step();
  };
  expectMode(moveTo(0.0345), Mode::engaged, Cause::requested);
  const rt::Tick leapt = moveTo(0.019);
  expectMode(leapt, Mode::holding, Cause::handle_too_fast);
  EXPECT_TRUE(leapt.released);
  expectMode(rig.steps(99), Mode::holding, Cause::handle_too_fast);
  expectMode(rig.step(), Mode::engaged, Cause::requested);
}

TEST(HapticCoreMode, HoldsOutsideTheWorkspace) {
  CoreRig rig;
  rig.engageFully();
  rig.directive.parameters.safety.workspace_radius_m = norm(rig.handle.position_m_in_world) - 0.001;
  expectMode(rig.step(), Mode::holding, Cause::outside_workspace);
  rig.directive.parameters.safety.workspace_radius_m = norm(rig.handle.position_m_in_world) + 0.001;
  expectMode(rig.step(), Mode::engaged, Cause::requested);
}

TEST(HapticCoreMode, HoldsAfterABurstOfLateTicksUntilTheLoopHasBeenPunctualForASecond) {
  CoreRig rig;
  rig.engageFully();
  rig.overran = true;
  expectMode(rig.steps(4), Mode::engaged, Cause::requested);
  expectMode(rig.step(), Mode::holding, Cause::overrun_burst);
  rig.overran = false;
  EXPECT_EQ(rig.steps(300).command_force_n_in_world, Vec3{});
  expectMode(rig.steps(700), Mode::holding, Cause::overrun_burst);
  // the five late ticks count as a burst as long as they are among the last 64
  expectMode(rig.steps(64), Mode::engaged, Cause::requested);
}

}  // namespace
}  // namespace hapticd::test
