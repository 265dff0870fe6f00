// SPDX-License-Identifier: Apache-2.0
// When a force loop counts as late, and that this ends.
#include "daemon/box_warnings.h"

#include <gtest/gtest.h>

namespace hapticd::daemon {
namespace {

/// A loop of 1 kHz, second by second.
class LatenessWatchTest : public testing::Test {
 protected:
  LatenessWatchTest() { watch_.follow(counters_, time_ns_); }

  /// Seconds in each of which so many ticks end late and so many periods are skipped.
  void run(int seconds, std::uint64_t late_ticks = 0, std::uint64_t skipped = 0) {
    for (int second = 0; second < seconds; ++second) {
      counters_.ticks += 1000 - skipped;
      counters_.overruns += late_ticks;
      counters_.skipped_periods += skipped;
      time_ns_ += 1'000'000'000;
      watch_.follow(counters_, time_ns_);
    }
  }
  bool late() const { return watch_.lateness().late; }

  LatenessWatch watch_;
  rt::LoopCounters counters_;
  std::int64_t time_ns_ = 5'000'000'000;
};

TEST_F(LatenessWatchTest, KeepsQuietAboutALoopThatKeepsTime) {
  EXPECT_FALSE(late());
  run(600);
  EXPECT_FALSE(late());
}

TEST_F(LatenessWatchTest, ForgivesTheColdTicksOfTheStart) {
  run(1, 3);
  EXPECT_FALSE(late());
  run(1, 1);
  EXPECT_TRUE(late());
}

TEST_F(LatenessWatchTest, KnowsMoreThanOneLateTickInTenThousand) {
  run(60);
  run(1, 6);
  EXPECT_FALSE(late()) << "6 of 60 000";
  run(1, 1);
  EXPECT_TRUE(late()) << "7 of 60 000";
}

TEST_F(LatenessWatchTest, KnowsASecondInWhichPeriodsWereSkipped) {
  run(10, 0, 5);
  EXPECT_FALSE(late());
  run(1, 0, 6);
  EXPECT_TRUE(late());
}

// The warning stood for ever when it was judged by the counts since the start.
TEST_F(LatenessWatchTest, EndsAMinuteAfterTheLastLateTick) {
  run(120, 50, 20);
  EXPECT_TRUE(late());
  run(59);
  EXPECT_TRUE(late());
  run(2);
  EXPECT_FALSE(late());
  EXPECT_EQ(watch_.lateness().late_ticks, 0U);
}

TEST_F(LatenessWatchTest, CountsWithinTheLastMinuteHoweverOftenItIsCalled) {
  run(300);
  for (int i = 0; i < 900; ++i) {
    counters_.ticks += 66;
    time_ns_ += 66'000'000;
    watch_.follow(counters_, time_ns_);
  }
  EXPECT_NEAR(static_cast<double>(watch_.lateness().ticks), 60'000, 1'100) << "a minute and up to a second";
}

}  // namespace
}  // namespace hapticd::daemon
