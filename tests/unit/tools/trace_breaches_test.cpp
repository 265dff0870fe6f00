// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "daemon/trace/export/trace_summary.h"
#include "tests/support/made_up_trace.h"
#include "tests/support/temporary_folder.h"
#include "tools/hapticctl/text/breach_text.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

constexpr std::int64_t kStart_ns = 5'000'000'000;
constexpr std::size_t kColumns = 80;

/// An event as the daemon writes it, `ended_s` after the first tick.
trace::EventRecord breachEvent(const std::string& fixture, double ended_s, double age_s, double duration_s,
                               double depth_m, double entry_m_per_s, double force_n) {
  return {.time_ns = kStart_ns + static_cast<std::int64_t>(ended_s * 1e9),
          .kind = "breach",
          .text = "the HIP was in " + fixture,
          .fields = {{"FIXTURE", fixture},
                     {"ENTERED_AGE_S", std::to_string(age_s)},
                     {"ENTERED_M", "0.01000 0.02000 -0.80000"},
                     {"DURATION_S", std::to_string(duration_s)},
                     {"DEPTH_M", std::to_string(depth_m)},
                     {"ENTRY_SPEED_M_PER_S", std::to_string(entry_m_per_s)},
                     {"SPEED_M_PER_S", std::to_string(2 * entry_m_per_s)},
                     {"FORCE_N", std::to_string(force_n)}}};
}

class TraceBreaches : public testing::Test {
 protected:
  TraceBreaches() {
    for (std::uint64_t number = 1; number <= 100; ++number) {
      rt::Tick tick;
      tick.number = number;
      tick.planned_ns = kStart_ns + static_cast<std::int64_t>(number - 1) * 1'000'000;
      records.ticks.push_back(tick);
    }
    trace::AdditionsRecord additions;
    additions.time_ns = kStart_ns;
    additions.text =
        "fixtures:\n"
        "  - {name: vein, kind: sphere, position_m: [0, 0, -1], radius_m: 0.05}\n"
        "  - {name: nerve, kind: sphere, position_m: [0, 0, -1], radius_m: 0.05}\n"
        "  - {name: path, kind: path, points_m: [[0, 0, -1], [0.1, 0, -1]]}\n"
        "  - {name: slow, kind: sphere, effect: slow, position_m: [0, 0, -1], radius_m: 0.05}\n"
        "  - {name: bone, kind: sphere, position_m: [0, 0, -1], radius_m: 0.05}\n";
    records.additions.push_back(additions);
  }

  trace::BreachReport reported() {
    const std::filesystem::path file = folder.path() / "a.mcap";
    std::filesystem::remove(file);
    test::writeTrace(file, records, 1000, {.realtime_offset_ns = 1'700'000'000'000'000'000});
    auto report = trace::breachesIn(file);
    EXPECT_TRUE(report) << report.error().text();
    return report ? *report : trace::BreachReport{};
  }

  test::TemporaryFolder folder;
  test::MadeUpRecords records;
};

TEST_F(TraceBreaches, AddsUpWhatEachFixtureSaw) {
  records.events = {breachEvent("nerve", 3, 2, 1.5, 0.004, 0.12, 1.5),
                    breachEvent("vein", 4, 1, 0.25, 0.002, 0.5, 2),
                    {.time_ns = kStart_ns + 5'000'000'000, .kind = "mark", .text = "a mark"},
                    breachEvent("nerve", 6, 2.5, 0.5, 0.006, 0.08, 1.25)};
  const trace::BreachReport report = reported();
  ASSERT_EQ(report.fixtures.size(), 3U) << "no guidance, and none that only slows";
  EXPECT_EQ(report.fixtures[0].fixture, "vein");
  EXPECT_EQ(report.fixtures[0].count, 1U);
  const trace::FixtureBreaches& nerve = report.fixtures[1];
  EXPECT_EQ(nerve.count, 2U);
  EXPECT_DOUBLE_EQ(nerve.total_s, 2);
  EXPECT_DOUBLE_EQ(nerve.longest_s, 1.5);
  EXPECT_DOUBLE_EQ(nerve.deepest_m, 0.006);
  EXPECT_DOUBLE_EQ(nerve.fastest_entry_m_per_s, 0.12);
  EXPECT_DOUBLE_EQ(nerve.largest_force_n, 1.5);
  EXPECT_EQ(report.fixtures[2].fixture, "bone");
  EXPECT_EQ(report.fixtures[2].count, 0U) << "listed all the same";
  EXPECT_FALSE(report.lacks_speeds);
}

TEST_F(TraceBreaches, ListsThemByWhenTheyBegan) {
  records.events = {breachEvent("vein", 4, 1, 0.25, 0.002, 0.5, 2),
                    breachEvent("nerve", 5, 4.5, 3.5, 0.004, 0.12, 1.5)};
  const trace::BreachReport report = reported();
  ASSERT_EQ(report.breaches.size(), 2U);
  EXPECT_EQ(report.breaches[0].fixture, "nerve");
  EXPECT_NEAR(report.breaches[0].time_s, 0.5, 1e-9);
  EXPECT_NEAR(report.breaches[1].time_s, 3, 1e-9);
  EXPECT_EQ(report.breaches[0].entered_m_in_world, (rt::Vec3{0.01, 0.02, -0.8}));
  EXPECT_DOUBLE_EQ(report.breaches[0].speed_m_per_s, 0.24);
}

TEST_F(TraceBreaches, LeaveBlankWhatAnOlderVersionDidNotWrite) {
  trace::EventRecord old = breachEvent("nerve", 3, 2, 1.5, 0.004, 0.12, 1.5);
  old.fields.resize(5);
  records.events = {old};
  const trace::BreachReport report = reported();
  EXPECT_TRUE(report.lacks_speeds);
  const Json json = breachJson(report);
  EXPECT_EQ(json["breaches"][0]["depthM"], 0.004);
  EXPECT_TRUE(json["breaches"][0]["entrySpeedMPerS"].is_null());
  EXPECT_TRUE(json["breaches"][0]["largestForceN"].is_null());
  EXPECT_TRUE(json["fixtures"][1]["fastestEntryMPerS"].is_null());
  const std::string text = breachText(report, kColumns);
  EXPECT_NE(text.find("older version"), std::string::npos) << text;
}

TEST_F(TraceBreaches, TakesAnyTextInAnEventForWhatItIs) {
  trace::EventRecord odd = breachEvent("a\nb\033[1m", 3, 2, 1.5, 0.004, 0.12, 1.5);
  odd.fields[1].second = "soon";
  odd.fields[2].second = "1 2";
  odd.fields[3].second = "inf";
  odd.fields[4].second = "";
  records.events = {odd, {.time_ns = kStart_ns, .kind = "breach", .text = ""}};
  const trace::BreachReport report = reported();
  ASSERT_EQ(report.breaches.size(), 2U);
  for (const trace::BreachEntry& entry : report.breaches) {
    EXPECT_TRUE(std::isnan(entry.time_s));
    EXPECT_TRUE(std::isnan(entry.duration_s));
    EXPECT_TRUE(std::isnan(entry.depth_m));
  }
  EXPECT_EQ(breachText(report, kColumns).find('\033'), std::string::npos);
}

TEST_F(TraceBreaches, SayWhereThereIsNone) {
  EXPECT_NE(breachText(reported(), kColumns).find("bone"), std::string::npos);
  records.additions.clear();
  EXPECT_NE(breachText(reported(), kColumns).find("no breach"), std::string::npos);
  const Json json = breachJson(reported());
  EXPECT_TRUE(json["fixtures"].empty());
  EXPECT_TRUE(json["breaches"].empty());
}

TEST_F(TraceBreaches, FitAnOrdinaryTerminal) {
  records.events = {breachEvent("nerve", 7203.5, 2, 1.5, 0.0341, 0.12, 11.5),
                    breachEvent("abcdefghijabcdefghijabcdefghijab", 4, 1, 1000.25, 0.0552, 1.5, 2)};
  std::istringstream lines(breachText(reported(), kColumns));
  std::size_t count = 0;
  for (std::string line; std::getline(lines, line); ++count) EXPECT_LE(line.size(), kColumns) << line;
  EXPECT_GE(count, 7U);
}

}  // namespace
}  // namespace hapticd::tools
