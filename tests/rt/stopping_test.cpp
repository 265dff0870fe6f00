// SPDX-License-Identifier: Apache-2.0
// Verifies that the force loop ends in any situation when asked to, with every stage enabled that delays a
// force.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>
#include <limits>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include "rt/loop/force_loop.h"
#include "tests/rt/loop_rig.h"
#include "tests/support/program.h"

namespace hapticd::test {
namespace {

using rt::Cause;
using rt::Mode;
using rt::Vec3;

constexpr double kMax_n = 0.5;
constexpr double kSlew_n_per_s = 1;
constexpr double kFilter_hz = 80;
constexpr double kFelt_n = 0.1;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kRounding = 1e-12;  // of forces below 1 N

/// A loop in a thread of its own, with all stages enabled, that is asked to stop at the end of a test.
class Stopping {
 public:
  Stopping() {
    rt::LiveParameters& live = rig.directive.parameters;
    live.blend.duration_s = 10;
    live.safety.max_force_n = kMax_n;
    live.safety.max_slew_n_per_s = kSlew_n_per_s;
    live.safety.engage_ramp_s = 0;
    live.safety.depth_ramp_s = 100;
    live.safety.continuous_force_n = 0.2;
    live.safety.thermal_time_s = 0.1;
    live.safety.force_filter_hz = kFilter_hz;
    live.safety.passivity_control = true;
    live.safety.stiffness_limit = rt::StiffnessLimit::reduce;
    rig.handle.session = 1;
    rig.handle.delay_s = 0.02;
    rig.moveHandle(touching);
  }
  ~Stopping() {
    if (!ended.valid()) return;
    rig.loop.requestStop();
    if (ended.wait_for(std::chrono::seconds(60)) == std::future_status::timeout) {
      // Resetting the low-pass drops the force, so that the test fails instead of hanging.
      ADD_FAILURE() << "the force loop does not end";
      rig.directive.parameters.safety.force_filter_hz = 0;
      rig.send();
    }
    ended.get();
  }

  void start() {
    ended = std::async(std::launch::async, [this] {
      rig.loop.prepare();
      rig.loop.run();
    });
  }
  /// Polls the ticks until one satisfies the condition.
  template <typename Like>
  bool reaches(Like like) {
    std::size_t looked_at = rig.ticks.size();
    return becomesTrue(
        [&] {
          rig.collected(0);
          const bool found =
              std::any_of(rig.ticks.begin() + static_cast<std::ptrdiff_t>(looked_at), rig.ticks.end(), like);
          looked_at = rig.ticks.size();
          return found;
        },
        std::chrono::milliseconds(1));
  }
  /// Engages and waits for a force that takes some time to drop.
  bool engage() {
    rig.directive.engage = true;
    rig.send();
    return reaches([](const rt::Tick& tick) {
      return tick.mode == Mode::engaged && norm(tick.command_force_n_in_world) > kFelt_n;
    });
  }
  /// Returns true when the loop ends; all its ticks are then in rig.ticks.
  bool stops() {
    rig.loop.requestStop();
    const bool ends = becomesTrue([this] {
      rig.collected(0);
      return ended.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
    });
    rig.collected(0);
    return ends;
  }
  std::vector<rt::Tick> stoppingTicks() const {
    std::vector<rt::Tick> ticks;
    std::ranges::copy_if(rig.ticks, std::back_inserter(ticks), [](const rt::Tick& t) { return t.stopping; });
    return ticks;
  }

  /// With this mass, delay and low-pass, 207 N/m of 500 would be stable.
  LoopRig rig{1000, {.handle = {}, .device_mass_kg = 0.3}};
  const Vec3 touching = rig.wall.inFrontOfWall(0.02);
  std::future<void> ended;
};

/// An event that happens to a loop exerting a force, and the resulting mode.
struct Situation {
  const char* name;
  Mode mode;
  Cause cause;
  void (*bringAbout)(Stopping&);
};

template <double rt::SafetyParameters::*Limit>
void setToNothing(Stopping& loop) {
  loop.rig.directive.parameters.safety.*Limit = 1e-9;
  loop.rig.send();
}

template <rt::HandleCondition Condition>
void becomeHandle(Stopping& loop) {
  loop.rig.handle.condition = Condition;
  loop.rig.moveHandle(loop.touching);
}

const Situation kSituations[] = {
    {"Engaged", Mode::engaged, Cause::requested, [](Stopping&) {}},
    {"Disengaged", Mode::idle, Cause::requested,
     [](Stopping& loop) {
       loop.rig.directive.engage = false;
       loop.rig.send();
     }},
    {"NoScene", Mode::holding, Cause::no_scene, [](Stopping& loop) { loop.rig.publishScene(0); }},
    {"DepthStale", Mode::holding, Cause::depth_stale, setToNothing<&rt::SafetyParameters::depth_timeout_s>},
    {"HandleStale", Mode::holding, Cause::handle_stale,
     setToNothing<&rt::SafetyParameters::handle_timeout_s>},
    {"HandleInvalid", Mode::holding, Cause::handle_invalid,
     [](Stopping& loop) {
       loop.rig.moveHandle({kNaN, 0, 0});
     }},
    {"HandleTooFast", Mode::holding, Cause::handle_too_fast,
     [](Stopping& loop) { loop.rig.moveHandle(loop.rig.wall.inFrontOfWall(9)); }},
    {"HandleClutched", Mode::holding, Cause::handle_clutched, becomeHandle<rt::HandleCondition::clutched>},
    {"HandleNotCalibrated", Mode::holding, Cause::handle_not_calibrated,
     becomeHandle<rt::HandleCondition::not_calibrated>},
    {"HandleReplaced", Mode::idle, Cause::handle_replaced,
     [](Stopping& loop) {
       loop.rig.handle.session = 2;
       loop.rig.moveHandle(loop.touching);
     }},
    {"OutsideWorkspace", Mode::holding, Cause::outside_workspace,
     setToNothing<&rt::SafetyParameters::workspace_radius_m>},
    {"OverrunBurst", Mode::holding, Cause::overrun_burst,
     [](Stopping& loop) {
       loop.rig.directive.parameters.safety.overrun_burst = 0;
       loop.rig.send();
     }},
    {"Faulted", Mode::faulted, Cause::force_not_finite,
     [](Stopping& loop) {
       loop.rig.directive.parameters.force.stiffness_n_per_m = std::numeric_limits<double>::infinity();
       loop.rig.send();
     }},
};

class StoppingForceLoop : public testing::TestWithParam<Situation> {};

TEST_P(StoppingForceLoop, EndsWithEveryStageOn) {
  Stopping loop;
  loop.start();
  ASSERT_TRUE(loop.engage());
  GetParam().bringAbout(loop);
  ASSERT_TRUE(loop.reaches(
      [](const rt::Tick& tick) { return tick.mode == GetParam().mode && tick.cause == GetParam().cause; }));
  ASSERT_TRUE(loop.stops());
  // The time that the slew limit needs from the largest force, the low-pass from 1000 N to 1e-9 N, a tenth of
  // a second, and a release.
  const double longest_s =
      kMax_n / kSlew_n_per_s + std::log(1e12) / (2 * std::numbers::pi * kFilter_hz) + 0.1;
  EXPECT_LE(static_cast<double>(loop.stoppingTicks().size()), std::ceil(1000 * longest_s) + 3);
  EXPECT_EQ(loop.rig.ticks.back().command_force_n_in_world, Vec3{});
}

INSTANTIATE_TEST_SUITE_P(Situations, StoppingForceLoop, testing::ValuesIn(kSituations),
                         [](const auto& instance) { return std::string(instance.param.name); });

TEST(StoppingLoop, GoesToZeroByItselfThroughEveryStage) {
  Stopping loop;
  loop.start();
  ASSERT_TRUE(loop.engage());
  ASSERT_TRUE(loop.reaches([](const rt::Tick& tick) { return tick.thermally_limited; }));
  loop.rig.directive.parameters.force.stiffness_n_per_m = 20;
  loop.rig.send();
  ASSERT_TRUE(loop.reaches([](const rt::Tick& tick) { return tick.blending; }));
  ASSERT_TRUE(loop.stops());
  const std::vector<rt::Tick>& ticks = loop.rig.ticks;
  const auto some = [&ticks](auto like) { return std::ranges::any_of(ticks, like); };
  EXPECT_TRUE(some([](const rt::Tick& t) { return t.stiffness_gain < 1; }));
  EXPECT_TRUE(some([](const rt::Tick& t) { return t.slew_limited; }));
  EXPECT_TRUE(
      some([](const rt::Tick& t) { return !(t.filtered_force_n_in_world == t.passive_force_n_in_world); }));
  EXPECT_FALSE(ticks.back().released) << "the stages reduced the force, it was not dropped";
  for (std::size_t i = 1; i < ticks.size(); ++i) {
    const double step_n = norm(ticks[i].command_force_n_in_world - ticks[i - 1].command_force_n_in_world);
    ASSERT_LE(step_n, kSlew_n_per_s * 0.001 + kRounding);
  }
}

TEST(StoppingLoop, DropsTheForceAfterFiveSecondsIfAStageHoldsIt) {
  Stopping loop;
  loop.start();
  ASSERT_TRUE(loop.engage());
  loop.rig.directive.parameters.safety.force_filter_hz = 1e-6;  // decays within a day
  loop.rig.send();
  ASSERT_TRUE(loop.reaches(
      [&](const rt::Tick& tick) { return tick.directive_generation == loop.rig.directive.generation; }));
  ASSERT_TRUE(loop.stops());
  const std::vector<rt::Tick> ticks = loop.stoppingTicks();
  ASSERT_GT(ticks.size(), 4U);
  EXPECT_LE(ticks.size(), 5003U);
  const auto released = std::ranges::find_if(ticks, [](const rt::Tick& tick) { return tick.released; });
  ASSERT_EQ(ticks.end() - released, 3);
  const Vec3 kept = (released - 1)->command_force_n_in_world;
  EXPECT_GT(norm(kept), kFelt_n / 2);
  for (int step = 0; step < 3; ++step) {
    const double left = (2.0 - step) / 3;
    EXPECT_LE(norm(released[step].command_force_n_in_world - left * kept), kRounding) << "step " << step + 1;
  }
  EXPECT_EQ(ticks.back().command_force_n_in_world, Vec3{});
  EXPECT_LT((released - 1)->planned_ns - ticks.front().planned_ns, 5'000'000'000);
}

}  // namespace
}  // namespace hapticd::test
