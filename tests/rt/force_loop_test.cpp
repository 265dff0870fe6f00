// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <random>
#include <thread>
#include <vector>

#include "rt/base/clock.h"
#include "rt/loop/force_loop.h"
#include "tests/rt/loop_rig.h"
#include "tests/support/flush_to_zero.h"
#include "tests/support/program.h"
#include "tests/support/rerun.h"

namespace hapticd::test {
namespace {

using rt::Vec3;

constexpr std::size_t kTicks = 300;
constexpr std::int64_t kPeriod_ns = 1'000'000;
constexpr double kPeriod_s = 0.001;
/// A few roundings of numbers of the size of the forces.
constexpr double kRounding = 1e-12;

class ForceLoopThread : public testing::Test {
 protected:
  explicit ForceLoopThread(double rate_hz = 1000) : rig(rate_hz) {}
  void start() {
    thread_ = std::jthread([this] {
      rig.loop.prepare();
      rig.loop.run();
    });
  }
  /// Stops the loop; afterwards all ticks are in rig.ticks.
  void stop() {
    rig.loop.requestStop();
    thread_.join();
    rig.collected(0);
  }
  ~ForceLoopThread() override { rig.loop.requestStop(); }

  /// Returns the newest published state once the loop has taken over the last directive.
  rt::LoopState acknowledged() {
    EXPECT_TRUE(becomesTrue([this] {
      rig.collected(0);
      rig.control->state.refresh();
      return rig.control->state.front().directive_generation == rig.directive.generation;
    }));
    return rig.control->state.front();
  }

  LoopRig rig;

 private:
  std::jthread thread_;
};

TEST(ForceLoopPreparation, KeepsSubnormalNumbersWhateverTheThreadInherits) {
  LoopRig rig(1000);
  std::jthread([&rig] {
    flushSubnormalsToZero();
    rig.loop.prepare();
    EXPECT_TRUE(keepsSubnormals());
  }).join();
}

TEST_F(ForceLoopThread, NumbersItsTicksWithoutAGapAndPutsEachIntoTheRing) {
  start();
  ASSERT_TRUE(exercise(rig, kTicks));
  stop();
  ASSERT_GE(rig.ticks.size(), kTicks - 3);
  for (std::size_t i = 0; i < rig.ticks.size(); ++i) ASSERT_EQ(rig.ticks[i].number, i + 1);
  EXPECT_EQ(rig.control->ticks.dropped(), 0U);
  rig.control->state.refresh();
  EXPECT_EQ(rig.control->state.front().tick.number, rig.ticks.size());
  EXPECT_EQ(rig.control->state.front().counters.ticks, rig.ticks.size());
  EXPECT_EQ(rig.control->wakeup_latency.total(), rig.ticks.size());
  EXPECT_EQ(rig.control->compute_time.total(), rig.ticks.size());
}

/// Returns the number of grid times after the tick's own that have passed when the tick ends.
std::uint64_t periodsOverrunBy(const rt::Tick& tick, std::int64_t period_ns) {
  return static_cast<std::uint64_t>((tick.wakeup_latency_ns + tick.compute_ns) / period_ns);
}

/// Each tick is at the first grid time after the end of the previous one. Ticks that did not fit into the
/// ring leave gaps in the numbers.
void expectOnGrid(const std::vector<rt::Tick>& ticks, std::int64_t period_ns) {
  for (std::size_t i = 1; i < ticks.size(); ++i) {
    if (ticks[i].number != ticks[i - 1].number + 1) continue;
    const auto periods = static_cast<std::int64_t>(1 + periodsOverrunBy(ticks[i - 1], period_ns));
    ASSERT_EQ(ticks[i].planned_ns - ticks[i - 1].planned_ns, periods * period_ns) << "tick " << i + 1;
  }
}

TEST_F(ForceLoopThread, PlansEveryTickOnOneGridAndCountsTheOverruns) {
  start();
  ASSERT_TRUE(rig.collect(kTicks));
  stop();
  expectOnGrid(rig.ticks, kPeriod_ns);
  std::uint64_t skipped = 0;
  std::uint64_t overruns = 0;
  for (const rt::Tick& tick : rig.ticks) {
    skipped += periodsOverrunBy(tick, kPeriod_ns);
    if (periodsOverrunBy(tick, kPeriod_ns) > 0) ++overruns;
  }
  rig.control->state.refresh();
  EXPECT_EQ(rig.control->state.front().counters.skipped_periods, skipped);
  EXPECT_EQ(rig.control->state.front().counters.overruns, overruns);
}

/// A rate that no machine achieves: waking up alone takes longer than the period.
class HastyForceLoopThread : public ForceLoopThread {
 protected:
  static constexpr std::int64_t kShortPeriod_ns = 100;
  HastyForceLoopThread() : ForceLoopThread(1e9 / kShortPeriod_ns) {}
};

TEST_F(HastyForceLoopThread, SkipsAndCountsWholePeriodsOnItsGrid) {
  start();
  ASSERT_TRUE(rig.collect(kTicks));
  stop();
  expectOnGrid(rig.ticks, kShortPeriod_ns);
  rig.control->state.refresh();
  const rt::LoopState& state = rig.control->state.front();
  ASSERT_EQ(rig.ticks.front().number, 1U);
  const auto elapsed_ns = static_cast<std::uint64_t>(state.tick.planned_ns - rig.ticks.front().planned_ns);
  const std::uint64_t skipped = elapsed_ns / kShortPeriod_ns - (state.tick.number - 1);
  EXPECT_EQ(state.counters.skipped_periods, skipped + periodsOverrunBy(state.tick, kShortPeriod_ns));
  EXPECT_GT(skipped, kTicks) << "otherwise the machine did keep that rate";
  EXPECT_GT(state.counters.overruns, 0U);
  EXPECT_LE(state.counters.overruns, state.counters.ticks);
}

TEST_F(ForceLoopThread, WakesAtItsTimesAndNotBefore) {
  start();
  ASSERT_TRUE(rig.collect(kTicks));
  stop();
  for (const rt::Tick& tick : rig.ticks) {
    ASSERT_GE(tick.wakeup_latency_ns, 0);
    ASSERT_GE(tick.compute_ns, 0);
  }
}

TEST_F(ForceLoopThread, CountsTheEventsOfItsTicks) {
  start();
  ASSERT_TRUE(exercise(rig, kTicks));
  stop();
  const auto count = [this](auto condition) {
    return static_cast<std::uint64_t>(std::count_if(rig.ticks.begin(), rig.ticks.end(), condition));
  };
  rig.control->state.refresh();
  const rt::LoopCounters& counters = rig.control->state.front().counters;
  EXPECT_EQ(counters.contact_ticks, count([](const rt::Tick& tick) { return tick.points_used > 0; }));
  EXPECT_EQ(counters.outside_model_ticks, count([](const rt::Tick& tick) { return tick.outside_model; }));
  EXPECT_EQ(counters.slew_limited_ticks, count([](const rt::Tick& tick) { return tick.slew_limited; }));
  EXPECT_EQ(counters.magnitude_clamped_ticks,
            count([](const rt::Tick& tick) { return tick.magnitude_clamped; }));
  EXPECT_EQ(counters.handle_invalid_ticks, count([](const rt::Tick& tick) {
              return tick.mode == rt::Mode::holding && tick.cause == rt::Cause::handle_invalid;
            }));
  EXPECT_EQ(counters.not_finite_ticks, 0U);
  EXPECT_GT(counters.contact_ticks, 0U);
  EXPECT_GT(counters.handle_invalid_ticks, 0U);
}

TEST_F(ForceLoopThread, AcknowledgesADirectiveWithTheFirstTickThatFollowsIt) {
  start();
  const double before_n = norm(acknowledged().tick.law_force_n_in_world);
  ASSERT_GT(before_n, 0);
  for (int doubled = 1; doubled <= 5; ++doubled) {
    rig.directive.parameters.force.stiffness_n_per_m *= 2;
    rig.send();
    // The law is linear in k_s; each search may sum the same points in another order.
    const double expected_n = std::ldexp(before_n, doubled);
    EXPECT_NEAR(norm(acknowledged().tick.law_force_n_in_world), expected_n, kRounding * expected_n);
  }
  stop();
}

TEST_F(ForceLoopThread, ShowsTheHandlesPositionToTheSceneThread) {
  start();
  const Vec3 position = rig.wall.inFrontOfWall(0.07);
  rig.moveHandle(position);
  EXPECT_TRUE(becomesTrue([&] {
    rig.focus.refresh();
    return rig.focus.front() == position;
  }));
  stop();
}

TEST_F(ForceLoopThread, CommandsTheForceOfEachTick) {
  rig.directive.engage = true;
  rig.directive.parameters.safety.engage_ramp_s = 0;
  rig.send();
  start();
  ASSERT_TRUE(rig.collect(50));
  ASSERT_TRUE(becomesTrue([this] {
    rig.handle_command.refresh();
    return rig.handle_command.front().tick > 50;
  }));
  const rt::HandleCommand command = rig.handle_command.front();
  stop();
  ASSERT_GE(rig.ticks.size(), command.tick);
  EXPECT_EQ(rig.ticks[command.tick - 1].command_force_n_in_world, command.force_n_in_world);
  EXPECT_GT(norm(command.force_n_in_world), 0);
}

TEST_F(ForceLoopThread, GoesToZeroAtTheSlewLimitBeforeItReturns) {
  rig.directive.parameters.safety.max_slew_n_per_s = 500;  // several ticks to zero
  rig.directive.engage = true;
  rig.directive.parameters.safety.engage_ramp_s = 0;
  rig.send();
  start();
  ASSERT_TRUE(becomesTrue([this] {
    rig.collected(0);
    return !rig.ticks.empty() && norm(rig.ticks.back().command_force_n_in_world) >= 3;
  })) << "contact must be established first";
  stop();
  const double step_n = rig.directive.parameters.safety.max_slew_n_per_s * kPeriod_s;
  for (std::size_t i = 1; i < rig.ticks.size(); ++i) {
    const Vec3 step = rig.ticks[i].command_force_n_in_world - rig.ticks[i - 1].command_force_n_in_world;
    ASSERT_LE(norm(step), step_n * (1 + kRounding) + kRounding);
  }
  ASSERT_GE(rig.ticks.size(), 6U) << "3 N at half a newton per tick";
  EXPECT_GT(norm(rig.ticks[rig.ticks.size() - 2].command_force_n_in_world), 0) << "returns once it is zero";
  EXPECT_EQ(rig.ticks.back().command_force_n_in_world, Vec3{});
  rig.handle_command.refresh();
  EXPECT_EQ(rig.handle_command.front().force_n_in_world, Vec3{}) << "the handle's last command";
  EXPECT_EQ(rig.handle_command.front().tick, rig.ticks.back().number);
}

TEST_F(ForceLoopThread, ReturnsAfterOneTickWhenItIsStoppedBeforeItStarts) {
  rig.loop.requestStop();
  start();
  stop();
  ASSERT_EQ(rig.ticks.size(), 1U);
  EXPECT_EQ(rig.ticks.front().command_force_n_in_world, Vec3{});
}

TEST_F(ForceLoopThread, CountsTicksThatDoNotFitIntoTheRingAndContinues) {
  start();
  constexpr std::uint64_t kOverfull = rt::kTickRingCapacity + 50;
  ASSERT_TRUE(becomesTrue([this] {
    rig.control->state.refresh();
    return rig.control->state.front().counters.ticks >= kOverfull;
  }));
  rig.loop.requestStop();
  ASSERT_TRUE(rig.collect(rt::kTickRingCapacity));
  stop();
  EXPECT_EQ(rig.ticks[rt::kTickRingCapacity - 1].number, rt::kTickRingCapacity);
  EXPECT_GE(rig.control->ticks.dropped(), 50U);
}

TEST(ForceLoopPrivileges, AreReportedAsTheSystemSeesThem) {
  LoopRig rig;
  rt::LoopPrivileges reported;
  int policy = 0;
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  std::thread([&] {
    reported = rig.loop.prepare();
    policy = ::sched_getscheduler(0);
    ::sched_getaffinity(0, sizeof cpus, &cpus);
  }).join();
  EXPECT_EQ(reported.realtime_scheduling, policy == SCHED_FIFO);
  if (reported.cpu >= 0) {
    EXPECT_EQ(CPU_COUNT(&cpus), 1);
    EXPECT_TRUE(CPU_ISSET(static_cast<std::size_t>(reported.cpu), &cpus));
  }
  if (!reported.realtime_scheduling) {
    reportNotChecked("the loop under SCHED_FIFO: not permitted here (RLIMIT_RTPRIO or CAP_SYS_NICE)");
  }
}

constexpr std::int64_t kStart_ns = 987'654'321'012'345;

rt::PeriodicClock startedClock(std::int64_t period_ns = kPeriod_ns) {
  rt::PeriodicClock clock(period_ns);
  clock.start(kStart_ns);
  return clock;
}

TEST(PeriodicClock, PlansTheFirstTickOnePeriodAfterTheStart) {
  EXPECT_EQ(startedClock().planned_ns(), kStart_ns + kPeriod_ns);
}

TEST(PeriodicClock, StaysOnTheGridForAThousandSecondsOfLateTicks) {
  rt::PeriodicClock clock = startedClock();
  for (std::int64_t tick = 1; tick <= 1'000'000; ++tick) {
    const std::int64_t late_ns = tick * 7919 % kPeriod_ns;
    ASSERT_EQ(clock.planned_ns(), kStart_ns + tick * kPeriod_ns);
    ASSERT_EQ(clock.advance(clock.planned_ns() + late_ns), 0U);
  }
}

TEST(PeriodicClock, SkipsNothingWhenATickEndsJustBeforeTheNextIsDue) {
  rt::PeriodicClock clock = startedClock();
  EXPECT_EQ(clock.advance(kStart_ns + 2 * kPeriod_ns - 1), 0U);
  EXPECT_EQ(clock.planned_ns(), kStart_ns + 2 * kPeriod_ns);
}

TEST(PeriodicClock, SkipsTheTickThatIsDueExactlyWhenThePreviousOneEnds) {
  rt::PeriodicClock clock = startedClock();
  EXPECT_EQ(clock.advance(kStart_ns + 2 * kPeriod_ns), 1U);
  EXPECT_EQ(clock.planned_ns(), kStart_ns + 3 * kPeriod_ns);
}

TEST(PeriodicClock, SkipsAndCountsWholePeriodsAfterALongOverrunAndKeepsItsPhase) {
  rt::PeriodicClock clock = startedClock();
  EXPECT_EQ(clock.advance(clock.planned_ns() + 1'234 * kPeriod_ns + 567), 1'234U);
  EXPECT_EQ(clock.planned_ns(), kStart_ns + 1'236 * kPeriod_ns);
  EXPECT_EQ(clock.advance(clock.planned_ns() + 1), 0U);
  EXPECT_EQ(clock.planned_ns(), kStart_ns + 1'237 * kPeriod_ns);
}

TEST(PeriodicClock, TreatsATimeBeforeItsTickAsNoOverrun) {
  rt::PeriodicClock clock = startedClock();
  EXPECT_EQ(clock.advance(kStart_ns - 10 * kPeriod_ns), 0U);
  EXPECT_EQ(clock.planned_ns(), kStart_ns + 2 * kPeriod_ns);
}

TEST(PeriodicClock, AgreesWithSteppingThroughTheGridForAnyPeriodAndOverrun) {
  std::mt19937_64 random(1);
  for (int round = 0; round < 2'000; ++round) {
    const std::int64_t period_ns = std::uniform_int_distribution<std::int64_t>(1, 2'000'000)(random);
    rt::PeriodicClock clock = startedClock(period_ns);
    std::int64_t expected_ns = kStart_ns + period_ns;
    for (int tick = 0; tick < 20; ++tick) {
      const std::int64_t now_ns =
          expected_ns + std::uniform_int_distribution<std::int64_t>(0, 5 * period_ns)(random);
      std::uint64_t expected_skipped = 0;
      expected_ns += period_ns;
      for (; expected_ns <= now_ns; expected_ns += period_ns) ++expected_skipped;
      ASSERT_EQ(clock.advance(now_ns), expected_skipped);
      ASSERT_EQ(clock.planned_ns(), expected_ns);
    }
  }
}

TEST(SleepUntil, ReturnsAfterTheTimeAndNotBefore) {
  const std::int64_t until_ns = rt::monotonicNow_ns() + 5 * kPeriod_ns;
  rt::sleepUntil(until_ns);
  EXPECT_GE(rt::monotonicNow_ns(), until_ns);
}

// A failure does not return and ends at ctest's time limit.
TEST(SleepUntil, ReturnsForATimeThatIsPast) {
  rt::sleepUntil(rt::monotonicNow_ns() - kPeriod_ns);
  rt::sleepUntil(0);
}

TEST(SleepUntil, ContinuesToSleepAfterASignal) {
  static std::atomic<int> signals;
  signals = 0;
  struct sigaction count {};
  struct sigaction before {};
  count.sa_handler = [](int) { signals.fetch_add(1); };
  ASSERT_EQ(::sigaction(SIGUSR1, &count, &before), 0);
  const pthread_t sleeper = ::pthread_self();
  const std::int64_t until_ns = rt::monotonicNow_ns() + 30 * kPeriod_ns;
  std::thread disturber([sleeper, until_ns] {
    while (signals.load() < 3 && rt::monotonicNow_ns() < until_ns) {
      ::pthread_kill(sleeper, SIGUSR1);
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  });
  rt::sleepUntil(until_ns);
  const std::int64_t woke_ns = rt::monotonicNow_ns();
  disturber.join();
  ::sigaction(SIGUSR1, &before, nullptr);
  EXPECT_GE(woke_ns, until_ns);
  EXPECT_GE(signals.load(), 1);
}

}  // namespace
}  // namespace hapticd::test
