// SPDX-License-Identifier: Apache-2.0
// Behaviour of the mode state machine for a law that holds a surface at its last seen position because it has
// come nearer than the camera can measure.

#include <gtest/gtest.h>

#include <cstdint>

#include "rt/loop/supervisor.h"

namespace hapticd::test {
namespace {

using rt::Cause;
using rt::Mode;
using rt::Supervisor;

constexpr double kTick_s = 0.001;

/// A supervisor with valid inputs and a law result set by the test.
class TooNearSurface : public testing::Test {
 protected:
  TooNearSurface() {
    scene.frame = 1;
    handle.sequence = 1;
    directive.engage = true;
    directive.engage_inside = true;
  }

  void step(const Supervisor::Contact& contact) {
    now_ns += 1'000'000;
    handle.time_ns = now_ns;
    if (depth_is_fresh) scene.frame_time_ns = now_ns;
    const Supervisor::Input input{now_ns, kTick_s, scene, handle, directive, start};
    supervisor.decide(input, supervisor.look(input), contact);
  }
  void steps(int count, const Supervisor::Contact& contact) {
    for (int i = 0; i < count; ++i) step(contact);
  }
  void expect(Mode mode, Cause cause) const {
    EXPECT_EQ(supervisor.mode(), mode);
    EXPECT_EQ(supervisor.cause(), cause);
  }

  static constexpr Supervisor::Contact kSeen{.in_contact = true, .too_near = false};
  static constexpr Supervisor::Contact kTooNear{.in_contact = true, .too_near = true};
  static constexpr Supervisor::Contact kNothing{};

  Supervisor supervisor;
  rt::Scene scene;
  rt::HandleState handle;
  rt::StartParameters start;
  rt::Directive directive;  // the timeout is 0.5 s, the fade 0.2 s, the engage ramp 0.5 s
  bool depth_is_fresh = true;
  std::int64_t now_ns = 5'000'000'000;
};

TEST_F(TooNearSurface, IsHeldForTheTimeoutOfDepthAndThenFades) {
  steps(501, kSeen);
  ASSERT_EQ(supervisor.gain(), 1);
  steps(501, kTooNear);  // the first of them is 500 ms old
  expect(Mode::engaged, Cause::requested);
  EXPECT_EQ(supervisor.gain(), 1);
  step(kTooNear);
  expect(Mode::holding, Cause::surface_too_near);
  constexpr double kRounding = 1e-9;  // of 200 sums
  EXPECT_NEAR(supervisor.gain(), 1 - kTick_s / 0.2, kRounding);
  steps(100, kTooNear);
  EXPECT_NEAR(supervisor.gain(), 1 - 101 * kTick_s / 0.2, kRounding);
  steps(100, kTooNear);
  EXPECT_EQ(supervisor.gain(), 0);
  expect(Mode::holding, Cause::surface_too_near);
}

TEST_F(TooNearSurface, EndsByItselfWhenItIsSeenAgain) {
  steps(1'500, kTooNear);
  ASSERT_EQ(supervisor.cause(), Cause::surface_too_near);
  step(kSeen);
  expect(Mode::engaged, Cause::requested);
  EXPECT_NEAR(supervisor.gain(), kTick_s / 0.5, 1e-12) << "the ramp restarts";
}

TEST_F(TooNearSurface, EndsByItselfWhenTheContactEnds) {
  steps(1'500, kTooNear);
  step(kNothing);
  expect(Mode::engaged, Cause::requested);
}

TEST_F(TooNearSurface, RestartsTheTimeoutWhenTheSurfaceIsSeen) {
  step(kSeen);
  for (int i = 0; i < 10; ++i) {
    steps(400, kTooNear);
    step(kSeen);
  }
  expect(Mode::engaged, Cause::requested);
}

TEST_F(TooNearSurface, YieldsToTheCauseStaleDepth) {
  steps(2, kSeen);
  depth_is_fresh = false;
  steps(1'000, kTooNear);
  expect(Mode::holding, Cause::depth_stale);
  depth_is_fresh = true;
  step(kTooNear);
  expect(Mode::holding, Cause::surface_too_near);
}

TEST_F(TooNearSurface, IsNoCauseWhileNobodyIsEngaged) {
  directive.engage = false;
  steps(1'500, kTooNear);
  EXPECT_EQ(supervisor.mode(), Mode::idle);
  EXPECT_NE(supervisor.cause(), Cause::surface_too_near);
}

}  // namespace
}  // namespace hapticd::test
