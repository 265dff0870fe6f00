// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/live/recent_events.h"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

namespace hapticd::tools::view {
namespace {

std::size_t bytesOf(const RecentEvents& events) {
  std::size_t bytes = 0;
  events.forEach([&](const Json& event) { bytes += event.dump().size(); });
  return bytes;
}

TEST(RecentEvents, AreTheNewestWithinTheirLimits) {
  std::mt19937 random(5);
  RecentEvents events;
  std::vector<Json> all;
  for (int number = 0; number < 500; ++number) {
    // now and then one that has hardly room beside others
    const std::size_t length = random() % (number % 20 == 0 ? 200'000 : 2000);
    all.push_back({{"number", number}, {"text", std::string(length, 'x')}});
    events.add(all.back());
    ASSERT_LE(events.size(), RecentEvents::kMost);
    ASSERT_LE(bytesOf(events), RecentEvents::kMostBytes);
    ASSERT_TRUE(events.contains(all.back()));
    const std::size_t next = all.size() - events.size() - 1;  // the newest that is not kept
    if (events.size() == RecentEvents::kMost || events.size() == all.size()) continue;
    ASSERT_GT(bytesOf(events) + all[next].dump().size(), RecentEvents::kMostBytes)
        << "it would have had room";
  }
}

TEST(RecentEvents, KeepNoneThatIsLongerThanAllMayBe) {
  RecentEvents events;
  events.add({{"text", "short"}});
  events.add({{"text", std::string(RecentEvents::kMostBytes, 'x')}});
  EXPECT_EQ(events.size(), 0U);
  events.add({{"text", "short"}});
  EXPECT_EQ(events.size(), 1U);
}

}  // namespace
}  // namespace hapticd::tools::view
