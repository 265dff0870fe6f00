// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/server/admission.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <string>
#include <vector>

namespace hapticd::tools::view {
namespace {

constexpr ConnectionLimits kLimits{.all = 10, .per_owner = 6};

std::vector<OpenConnection> unheardOf(const std::string& owner, std::size_t count) {
  return {count, {.owner = owner}};
}

TEST(Admission, LetsInWhileThereIsRoom) {
  const std::vector<OpenConnection> open = unheardOf("a", 5);
  EXPECT_TRUE(admissionOf(open, "a", kLimits).is_served);
  EXPECT_FALSE(admissionOf(open, "a", kLimits).gives_way);
}

TEST(Admission, LetsTheOldestUnheardOneOfAUserWithHisShareGiveWay) {
  std::vector<OpenConnection> open{{"b"}, {"a", true}};
  const auto others = unheardOf("a", 5);
  open.insert(open.end(), others.begin(), others.end());
  const Admission admission = admissionOf(open, "a", kLimits);
  EXPECT_TRUE(admission.is_served);
  EXPECT_EQ(admission.gives_way, 2U);
}

TEST(Admission, LetsNoConnectionThatIsBeingAnsweredGiveWay) {
  std::vector<OpenConnection> open(6, {"a", true});
  EXPECT_FALSE(admissionOf(open, "a", kLimits).is_served);
  open.resize(10, {"b", true});
  EXPECT_FALSE(admissionOf(open, "c", kLimits).is_served);
}

TEST(Admission, TakesFromTheUserWithMostUnheardOnesWhereAllPlacesAreTaken) {
  std::vector<OpenConnection> open{{"b"}, {"b"}, {"b"}, {"b"}};
  const auto others = unheardOf("a", 6);
  open.insert(open.end(), others.begin(), others.end());
  EXPECT_EQ(admissionOf(open, "c", kLimits).gives_way, 4U);
  EXPECT_EQ(admissionOf(open, "b", kLimits).gives_way, 4U);
  EXPECT_EQ(admissionOf(open, "a", kLimits).gives_way, 4U);
}

/// Whoever comes in whatever order: the limits hold, and who has not his share comes in unless all others are
/// being answered.
TEST(Admission, KeepsLimitsAndSharesOverRandomConnections) {
  std::mt19937 random(3);
  const std::vector<std::string> owners{"a", "b", "c", "d"};
  std::vector<OpenConnection> open;
  for (int step = 0; step < 20'000; ++step) {
    const std::string& owner = owners[std::min<std::size_t>(random() % 6, 3)];
    const std::size_t choice = random() % 10;
    if (choice == 0 && !open.empty()) {
      open.erase(open.begin() + static_cast<std::ptrdiff_t>(random() % open.size()));
    } else if (choice == 1 && !open.empty()) {
      open[random() % open.size()].is_admitted = true;
    } else {
      const Admission admission = admissionOf(open, owner, kLimits);
      const auto own = std::ranges::count(open, owner, &OpenConnection::owner);
      const bool any_unheard = std::ranges::any_of(open, [](const auto& each) { return !each.is_admitted; });
      const bool must_serve =
          own < static_cast<std::ptrdiff_t>(kLimits.per_owner) && (any_unheard || open.size() < kLimits.all);
      ASSERT_TRUE(admission.is_served || !must_serve);
      if (admission.gives_way) {
        const auto place = static_cast<std::ptrdiff_t>(*admission.gives_way);
        const OpenConnection victim = open[*admission.gives_way];
        ASSERT_FALSE(victim.is_admitted);
        for (std::ptrdiff_t i = 0; i < place; ++i) {
          const OpenConnection& older = open[static_cast<std::size_t>(i)];
          ASSERT_TRUE(older.is_admitted || older.owner != victim.owner);
        }
        open.erase(open.begin() + place);
      }
      if (admission.is_served) open.push_back({owner});
    }
    ASSERT_LE(open.size(), kLimits.all);
    for (const std::string& each : owners) {
      ASSERT_LE(std::ranges::count(open, each, &OpenConnection::owner),
                static_cast<std::ptrdiff_t>(kLimits.per_owner));
    }
  }
}

}  // namespace
}  // namespace hapticd::tools::view
