// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/commands/message_gate.h"

#include <gtest/gtest.h>

namespace hapticd::tools::ros {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t kNow_ns = 1'800'000'000'000'000'000;  // UTC
constexpr std::int64_t kMs_ns = 1'000'000;
const std::chrono::steady_clock::time_point kBegin(1000s);

MessageHead sentAgo(std::int64_t age_ms, std::uint64_t publisher = 1) {
  return {.publisher = publisher,
          .stamp_utc_ns = 0,
          .sent_utc_ns = kNow_ns - age_ms * kMs_ns,
          .frame = "box/world"};
}

TEST(MessageGate, TakesAMessageUntilItIsTooOldByItsStampElseByWhenItWasSent) {
  MessageGate gate({.most_per_second = 1000, .oldest = 20ms});
  EXPECT_FALSE(gate.refusal(sentAgo(20), kNow_ns, kBegin));
  EXPECT_TRUE(gate.refusal(sentAgo(21), kNow_ns, kBegin));
  MessageHead stamped = sentAgo(0);
  stamped.stamp_utc_ns = kNow_ns - 21 * kMs_ns;  // measured earlier than it was sent
  EXPECT_TRUE(gate.refusal(stamped, kNow_ns, kBegin));
  stamped = sentAgo(21);
  stamped.stamp_utc_ns = kNow_ns - 3 * kMs_ns;
  EXPECT_FALSE(gate.refusal(stamped, kNow_ns, kBegin));
}

TEST(MessageGate, RefusesWhatComesFromTheFuture) {
  MessageGate gate({.most_per_second = 1000, .oldest = 20ms});
  EXPECT_FALSE(gate.refusal(sentAgo(-5), kNow_ns, kBegin));
  const auto refusal = gate.refusal(sentAgo(-6), kNow_ns, kBegin);
  ASSERT_TRUE(refusal);
  EXPECT_TRUE(refusal->contains("synchronise the clocks")) << *refusal;
}

TEST(MessageGate, RefusesAnotherFrameAndNamesBoth) {
  MessageGate gate({.most_per_second = 1000, .oldest = 20ms, .frame = "box/world"});
  EXPECT_FALSE(gate.refusal(sentAgo(0), kNow_ns, kBegin));
  MessageHead other = sentAgo(0);
  other.frame = "base_link";
  const auto refusal = gate.refusal(other, kNow_ns, kBegin);
  ASSERT_TRUE(refusal);
  EXPECT_TRUE(refusal->contains("\"base_link\"") && refusal->contains("\"box/world\"")) << *refusal;
  other.frame = "";
  EXPECT_TRUE(gate.refusal(other, kNow_ns, kBegin));
}

TEST(MessageGate, TakesSoManyEachSecondHoweverManyCome) {
  MessageGate gate({.most_per_second = 100, .oldest = 20ms});
  int taken = 0;
  for (int i = 0; i < 5000; ++i) {
    if (!gate.refusal(sentAgo(0), kNow_ns, kBegin + i * 1ms)) ++taken;
  }
  EXPECT_EQ(taken, 500);
}

TEST(MessageGate, TakesOnePublisherUntilItHasBeenSilentForASecond) {
  MessageGate gate({.most_per_second = 1000, .oldest = 20ms, .one_publisher = true});
  EXPECT_FALSE(gate.refusal(sentAgo(0, 1), kNow_ns, kBegin));
  EXPECT_TRUE(gate.refusal(sentAgo(0, 2), kNow_ns, kBegin + 10ms));
  EXPECT_FALSE(gate.refusal(sentAgo(0, 1), kNow_ns, kBegin + 20ms));
  EXPECT_TRUE(gate.refusal(sentAgo(0, 2), kNow_ns, kBegin + 1019ms))
      << "a refused one does not take the place";
  EXPECT_FALSE(gate.refusal(sentAgo(0, 2), kNow_ns, kBegin + 1020ms));
  EXPECT_TRUE(gate.refusal(sentAgo(0, 1), kNow_ns, kBegin + 1030ms));
}

}  // namespace
}  // namespace hapticd::tools::ros
