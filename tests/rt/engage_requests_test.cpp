// SPDX-License-Identifier: Apache-2.0
// The effect of repeated requests to engage on the force; the core is driven as by the daemon.
#include "rt/loop/supervisor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "tests/rt/core_rig.h"

namespace hapticd::test {
namespace {

using rt::Cause;
using rt::Mode;

/// A rig with a client. Nothing has been requested yet, and the HIP is in contact.
class RequestRig : public CoreRig {
 public:
  RequestRig() { directive.engage_inside = false; }

  /// Sends a request; returns true if the directive was changed.
  bool ask(bool engage, bool inside = false) {
    const bool changed = requests.ask(engage, inside, loop, directive);
    if (changed) ++directive.generation;
    return changed;
  }
  rt::Tick tick() {
    loop.tick = step();
    loop.directive_generation = directive.generation;
    return loop.tick;
  }
  rt::Tick ticks(int count) {
    for (int i = 0; i < count; ++i) tick();
    return loop.tick;
  }
  void expect(Mode mode, Cause cause) const {
    EXPECT_EQ(loop.tick.mode, mode);
    EXPECT_EQ(loop.tick.cause, cause);
  }

  rt::EngageRequests requests;
  rt::LoopState loop;
};

/// Returns the ticks from the first request on, always in contact: the ramp, the full force, and a depth
/// image that is stale for a while (the timeout is 500 ms). `again`: repeats the request in every 50th tick.
std::vector<rt::Tick> ticksInContact(bool again, bool inside) {
  RequestRig rig;
  rig.tick();
  rig.ask(true, true);
  std::vector<rt::Tick> ticks;
  for (int i = 0; i < 1'600; ++i) {
    if (again && i % 50 == 49) rig.ask(true, inside);
    rig.scene_fresh = i < 700 || i > 1'400;
    ticks.push_back(rig.tick());
  }
  return ticks;
}

TEST(EngageRequests, RepeatedRequestsInContactChangeNoBitOfForceGainModeAndCause) {
  const std::vector<rt::Tick> once = ticksInContact(false, false);
  EXPECT_TRUE(std::ranges::any_of(once, [](const rt::Tick& tick) { return tick.mode == Mode::holding; }));
  EXPECT_GT(norm(once[699].command_force_n_in_world), 1);
  for (const bool inside : {false, true}) {
    const std::vector<rt::Tick> again = ticksInContact(true, inside);
    for (std::size_t i = 0; i < once.size(); ++i) {
      ASSERT_EQ(again[i].mode, once[i].mode) << i;
      ASSERT_EQ(again[i].cause, once[i].cause) << i;
      ASSERT_EQ(again[i].gain, once[i].gain) << i;
      ASSERT_EQ(again[i].command_force_n_in_world, once[i].command_force_n_in_world) << i;
    }
  }
}

TEST(EngageRequests, ARepeatedRequestBeforeTheLoopHasSeenTheFirstChangesNothing) {
  RequestRig rig;
  rig.tick();
  EXPECT_TRUE(rig.ask(true, true));
  EXPECT_FALSE(rig.ask(true, true));
  EXPECT_FALSE(rig.ask(true));
  rig.tick();
  rig.expect(Mode::engaged, Cause::requested);
}

TEST(EngageRequests, ARefusedRequestMayBeRepeated) {
  RequestRig rig;
  rig.tick();
  rig.ask(true);
  rig.tick();
  rig.expect(Mode::idle, Cause::inside_surface);
  EXPECT_TRUE(rig.ask(true));
  rig.tick();
  rig.expect(Mode::idle, Cause::inside_surface);
  EXPECT_TRUE(rig.ask(true, true));
  rig.tick();
  rig.expect(Mode::engaged, Cause::requested);
}

TEST(EngageRequests, AReconnectedHandleEngagesOnTheNextRequest) {
  RequestRig rig;
  rig.handle.session = 1;
  rig.tick();
  rig.ask(true, true);
  rig.ticks(100);
  rig.handle.session = 2;
  ++rig.handle.sequence;
  rig.ticks(2);
  rig.expect(Mode::idle, Cause::handle_replaced);
  EXPECT_TRUE(rig.ask(true, true));
  rig.tick();
  rig.expect(Mode::engaged, Cause::requested);
}

TEST(EngageRequests, EngagingInsideASurfaceCanBePermittedWhileTheRequestIsPending) {
  RequestRig rig;
  rig.scene_fresh = false;
  rig.tick();
  EXPECT_TRUE(rig.ask(true));
  rig.tick();
  rig.expect(Mode::holding, Cause::depth_stale);
  EXPECT_TRUE(rig.ask(true, true));
  EXPECT_FALSE(rig.ask(true));  // does not revoke it
  rig.scene_fresh = true;
  rig.tick();
  rig.expect(Mode::engaged, Cause::requested);
}

TEST(EngageRequests, EngagingClearsNoFaultAndDisengagingDoes) {
  RequestRig rig;
  rig.tick();
  rig.ask(true, true);
  rig.ticks(600);
  rig.directive.parameters.force.stiffness_n_per_m = std::numeric_limits<double>::infinity();
  rig.tick();
  rig.directive.parameters.force.stiffness_n_per_m = 500;
  rig.expect(Mode::faulted, Cause::force_not_finite);
  for (const bool inside : {false, true}) {
    rig.ask(true, inside);
    rig.tick();
    rig.expect(Mode::faulted, Cause::force_not_finite);
  }
  rig.ask(false);
  rig.tick();
  rig.expect(Mode::idle, Cause::requested);
}

TEST(EngageRequests, DisengagingAndEngagingWithinOneTickIsANewRequest) {
  RequestRig rig;
  rig.tick();
  rig.ask(true, true);
  rig.ticks(600);
  rig.ask(false);
  rig.ask(true);
  rig.tick();
  rig.expect(Mode::idle, Cause::inside_surface);
  rig.ask(false);
  rig.tick();
  rig.expect(Mode::idle, Cause::inside_surface);  // disengaging when idle changes nothing
}

}  // namespace
}  // namespace hapticd::test
