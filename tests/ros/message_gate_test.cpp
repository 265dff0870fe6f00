// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/commands/command_inputs.h"

#include <gtest/gtest.h>

#include <algorithm>

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

TEST(MessageGate, DropsEvenlyWhatIsTooMuch) {
  MessageGate gate({.most_per_second = 100, .oldest = 20ms});
  int taken = 0, longest_ms = 0, gap_ms = 0;
  for (int ms = 0; ms < 5000; ++ms) {
    const bool is_taken = !gate.refusal(sentAgo(0), kNow_ns, kBegin + ms * 1ms);
    taken += is_taken ? 1 : 0;
    gap_ms = is_taken ? 0 : gap_ms + 1;
    longest_ms = std::max(longest_ms, gap_ms);
  }
  EXPECT_EQ(taken, 100 + 499) << "those of a second before, and one each 10 ms";
  EXPECT_EQ(longest_ms, 9);
}

TEST(MessageGate, TakesTheFirstPublisherOfWhichAMessageWasUsedUntilItIsSilent) {
  MessageGate gate({.most_per_second = 1000, .oldest = 20ms, .one_publisher = true});
  // a message of which nothing can be used, as one of NaN, takes no place
  const auto takes = [&](std::uint64_t publisher, std::chrono::milliseconds at, bool is_valid = true) {
    if (gate.refusal(sentAgo(0, publisher), kNow_ns, kBegin + at)) return false;
    if (is_valid) gate.used(sentAgo(0, publisher), kBegin + at);
    return true;
  };
  EXPECT_TRUE(takes(3, 0ms, false));
  EXPECT_TRUE(takes(1, 1ms));
  EXPECT_FALSE(takes(3, 2ms, false));
  EXPECT_FALSE(takes(2, 10ms));
  EXPECT_TRUE(takes(1, 20ms));
  EXPECT_FALSE(takes(2, 1019ms)) << "a refused one does not take the place";
  EXPECT_TRUE(takes(1, 1019ms, false));
  EXPECT_FALSE(takes(2, 2018ms)) << "it is not silent";
  EXPECT_TRUE(takes(2, 2019ms));
  EXPECT_FALSE(takes(1, 2020ms));
}

}  // namespace
}  // namespace hapticd::tools::ros
