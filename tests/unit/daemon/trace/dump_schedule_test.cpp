// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/dump_schedule.h"

#include <gtest/gtest.h>

#include "drivers/trace/trace_folder.h"

namespace hapticd::daemon {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

rt::Tick tickAt(std::int64_t time_ns, rt::Mode mode = rt::Mode::engaged, rt::Cause cause = rt::Cause::none) {
  rt::Tick tick;
  tick.planned_ns = time_ns;
  tick.mode = mode;
  tick.cause = cause;
  return tick;
}
rt::Tick burstAt(std::int64_t time_ns) {
  return tickAt(time_ns, rt::Mode::holding, rt::Cause::overrun_burst);
}
rt::Tick faultAt(std::int64_t time_ns) {
  return tickAt(time_ns, rt::Mode::faulted, rt::Cause::force_not_finite);
}

TEST(DumpSchedule, IsDueOnceASecondAfterTheFirstTickOfAFault) {
  DumpSchedule dumps(10);
  dumps.add(tickAt(kSecond_ns));
  dumps.add(faultAt(2 * kSecond_ns));
  dumps.add(faultAt(2 * kSecond_ns + 1));
  EXPECT_FALSE(dumps.takeDue(3 * kSecond_ns - 1));
  EXPECT_EQ(dumps.takeDue(3 * kSecond_ns), drivers::kFaultLabel);
  EXPECT_FALSE(dumps.takeDue(100 * kSecond_ns));
}

TEST(DumpSchedule, ABurstWaitsUntilTheFlightRecorderHoldsNothingOfTheDumpBefore) {
  DumpSchedule dumps(10);
  dumps.add(burstAt(kSecond_ns));
  EXPECT_EQ(dumps.takeDue(2 * kSecond_ns), drivers::kOverrunBurstLabel);
  dumps.add(tickAt(3 * kSecond_ns));
  dumps.add(burstAt(4 * kSecond_ns));
  EXPECT_FALSE(dumps.takeDue(12 * kSecond_ns - 1));
  EXPECT_EQ(dumps.takeDue(12 * kSecond_ns), drivers::kOverrunBurstLabel);
}

TEST(DumpSchedule, AFaultTakesThePlaceOfABurstThatWaits) {
  DumpSchedule dumps(10);
  dumps.add(burstAt(kSecond_ns));
  ASSERT_TRUE(dumps.takeDue(2 * kSecond_ns));
  dumps.add(tickAt(3 * kSecond_ns));
  dumps.add(burstAt(4 * kSecond_ns));
  dumps.add(faultAt(5 * kSecond_ns));
  EXPECT_EQ(dumps.takeDue(6 * kSecond_ns), drivers::kFaultLabel);
  EXPECT_FALSE(dumps.takeWaiting());
}

TEST(DumpSchedule, GivesWhatWaitsAtTheEnd) {
  DumpSchedule dumps(10);
  EXPECT_FALSE(dumps.takeWaiting());
  dumps.add(burstAt(kSecond_ns));
  EXPECT_EQ(dumps.takeWaiting(), drivers::kOverrunBurstLabel);
  EXPECT_FALSE(dumps.takeWaiting());
}

TEST(DumpSchedule, IsNeverDueWithoutAFlightRecorder) {
  DumpSchedule dumps(0);
  dumps.add(faultAt(kSecond_ns));
  EXPECT_FALSE(dumps.takeDue(100 * kSecond_ns));
  EXPECT_FALSE(dumps.takeWaiting());
}

}  // namespace
}  // namespace hapticd::daemon
