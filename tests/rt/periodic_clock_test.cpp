// SPDX-License-Identifier: Apache-2.0
#include "rt/base/clock.h"

#include <gtest/gtest.h>
#include <pthread.h>
#include <signal.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <random>
#include <thread>

namespace hapticd::test {
namespace {

constexpr std::int64_t kPeriod_ns = 1'000'000;
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
