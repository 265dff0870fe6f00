// SPDX-License-Identifier: Apache-2.0
#include "rt/base/fields.h"

#include <gtest/gtest.h>

#include <concepts>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "rt/loop/loop_state.h"

namespace hapticd::rt {
namespace {

struct Inner {
  int first_n = 1;
  double second_m = 2;
};
struct Outer {
  int plain_ns = 3;
  Inner inner;
  double spare_s = 0;
};

template <std::same_as<Outer> Record>
constexpr auto fieldsOf(std::type_identity<Record>) {
  return std::tuple{
      HAPTICD_FIELD(plain_ns, "How long").counter("outer_plain_seconds"),
      HAPTICD_FIELD(inner.first_n, "First").tracedAs("first"),
      HAPTICD_FIELD(inner.second_m, "Second").named("other").gauge("outer_second_metres"),
      HAPTICD_FIELD(spare_s, "Spare").shownAs([](const auto& outer) { return ifPositive(outer.spare_s); }),
      HAPTICD_TRACED(inner)};
}

TEST(Fields, AreNamedByThePathsOfTheirMembers) {
  std::vector<std::string> traced, shown;
  forEachField<Outer>([&](const auto& field) { traced.emplace_back(field.trace_name.text()); });
  forEachShownField<Outer>([&](const auto& field) { shown.emplace_back(field.json_name.text()); });
  EXPECT_EQ(traced, (std::vector<std::string>{"plain_ns", "first", "inner_second_m", "spare_s", "inner"}));
  EXPECT_EQ(shown, (std::vector<std::string>{"plainNs", "innerFirstN", "other", "spareS"}));
}

TEST(Fields, ReachTheMemberAndWhatIsShownOfIt) {
  Outer outer{7, {8, 9}, 0};
  std::get<1>(kFields<Outer>).get(outer) = 80;
  EXPECT_EQ(outer.inner.first_n, 80);
  EXPECT_EQ(std::get<2>(kFields<Outer>).show(outer), 9);
  EXPECT_EQ(std::get<3>(kFields<Outer>).show(outer), std::nullopt);
  outer.spare_s = 0.5;
  EXPECT_EQ(std::get<3>(kFields<Outer>).show(outer), 0.5);
}

TEST(Fields, OfOneMemberCountOnceAndMustCoverAll) {
  static_assert(memberCount<Inner>() == 2 && memberCount<Outer>() == 3);
  constexpr std::tuple all{HAPTICD_TRACED(inner.first_n), HAPTICD_TRACED(plain_ns),
                           HAPTICD_TRACED(inner.second_m), HAPTICD_TRACED(spare_s)};
  static_assert(memberCountOf(all, std::make_index_sequence<4>()) == 3);
  constexpr std::tuple without_one{HAPTICD_TRACED(inner.first_n), HAPTICD_TRACED(inner.second_m),
                                   HAPTICD_TRACED(spare_s)};
  static_assert(memberCountOf(without_one, std::make_index_sequence<3>()) == 2);
}

TEST(Fields, OfATickHaveNamesOfTheirOwnAndHelpWithoutAFullStop) {
  std::set<std::string_view> traced, shown;
  forEachField<Tick>([&](const auto& field) {
    EXPECT_TRUE(traced.insert(field.trace_name.text()).second) << field.path;
    EXPECT_FALSE(field.help.ends_with('.')) << field.path;
  });
  forEachShownField<Tick>([&](const auto& field) {
    EXPECT_TRUE(shown.insert(field.json_name.text()).second) << field.path;
    EXPECT_FALSE(field.help.empty()) << field.path;
  });
}

}  // namespace
}  // namespace hapticd::rt
