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
#include "tools/hapticctl/text/list_text.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

constexpr std::int64_t kHour_ns = 3600'000'000'000;
constexpr std::int64_t kNow_ns = 1'772'600'767'000'000'000;  // 2026-03-04 05:06:07 UTC

const Json kReply = Json::parse(R"({"folder": "/x", "omitted": 0, "traces": [
  {"name": "2026-03-03T05-06-07Z-left", "bytes": 5000000, "open": false, "depth": true, "kept": true,
   "note": "the good one", "beginNs": 1772514367000000000},
  {"name": "2026-03-04T04-06-07Z-right", "bytes": 1000, "open": false, "depth": false, "kept": false,
   "note": "", "beginNs": 1772597167000000000},
  {"name": "2026-03-04T05-06-00Z", "bytes": 2000000000, "open": true, "depth": false, "kept": false,
   "note": "", "beginNs": 1772600760000000000}]})");

/// Returns which of the three traces are chosen, by their indices in the reply.
std::string chosen(const TraceListOptions& options) {
  std::string places;
  for (const Json& trace : chosenTraces(kReply, options)) {
    for (std::size_t i = 0; i < kReply["traces"].size(); ++i) {
      if (kReply["traces"][i] == trace) places += std::to_string(i);
    }
  }
  return places;
}

TEST(TraceList, IsFilteredByLabelTimeAndState) {
  EXPECT_EQ(chosen({}), "012");
  EXPECT_EQ(chosen({.label = "left"}), "0");
  EXPECT_EQ(chosen({.label = "2026"}), "") << "the time in a name is no label";
  EXPECT_EQ(chosen({.since_ns = kNow_ns - 2 * kHour_ns}), "12");
  EXPECT_EQ(chosen({.until_ns = kNow_ns - 2 * kHour_ns}), "0");
  EXPECT_EQ(chosen({.since_ns = kNow_ns - 2 * kHour_ns, .until_ns = kNow_ns - kHour_ns}), "1");
  EXPECT_EQ(chosen({.state = "writing"}), "2");
  EXPECT_EQ(chosen({.state = "finished"}), "01");
  EXPECT_EQ(chosen({.state = "kept"}), "0");
}

TEST(TraceList, IsSortedAsAskedFor) {
  EXPECT_EQ(chosen({.sort = "size"}), "102");
  EXPECT_EQ(chosen({.sort = "name"}), "012");
  EXPECT_EQ(chosen({.sort = "size", .reverse = true}), "201");
}

TEST(TraceList, ShowsAgeSizeStateAndNoteAndSumsUp) {
  const std::string text = traceListText(kReply["traces"], kReply, kNow_ns, TerminalSize::kNoLimit);
  EXPECT_EQ(
      text,
      "NAME                        BEGIN                    AGE    SIZE  STATE                       NOTE\n"
      "2026-03-03T05-06-07Z-left   2026-03-03 05:06:07Z    24 h  5.0 MB  finished, kept, with depth  the "
      "good one\n"
      "2026-03-04T04-06-07Z-right  2026-03-04 04:06:07Z  60 min  1.0 kB  finished\n"
      "2026-03-04T05-06-00Z        2026-03-04 05:06:00Z     7 s  2.0 GB  being written\n"
      "3 traces, 2.0 GB\n");
}

TEST(TraceList, ShowsAndUsesAgesOnlyWhereTheClockWasSet) {
  Json reply = kReply;
  const Json unset{
      {"name", "1970-01-01T00-00-07Z"}, {"bytes", 1000}, {"beginNs", 7'000'000'000}, {"clockIsSet", false}};
  reply["traces"].push_back(unset);
  const std::string text = traceListText(Json::array({unset}), reply, kNow_ns, TerminalSize::kNoLimit);
  EXPECT_NE(text.find("\n1970-01-01T00-00-07Z  -        -  1.0 kB  finished\n"), std::string::npos) << text;
  const std::string no_ages = traceListText(kReply["traces"], kReply, std::nullopt, TerminalSize::kNoLimit);
  EXPECT_EQ(no_ages.find("24 h"), std::string::npos) << no_ages;
  EXPECT_NE(no_ages.find("2026-03-03 05:06:07Z    -"), std::string::npos) << no_ages;

  EXPECT_EQ(latestBegin_ns(reply), 1772600760000000000);
  EXPECT_TRUE(chosenTraces(reply, {.until_ns = kNow_ns - 3 * 24 * kHour_ns}).empty());
  const TraceDeletion deletion = deletionBefore(kNow_ns - 30 * kHour_ns, reply);
  EXPECT_TRUE(deletion.to_delete.empty()) << deletion.to_delete;
  ASSERT_EQ(deletion.staying.size(), 1U);
  EXPECT_NE(deletion.staying[0].find("its age is not known"), std::string::npos) << deletion.staying[0];
}

TEST(TraceList, DamagedOriginalsAreListedAndDeletedLikeTraces) {
  Json reply = kReply;
  const std::string name = "2026-03-03T05-06-07Z-left.mcap.damaged";
  reply["traces"].push_back(
      {{"name", name}, {"bytes", 1000}, {"open", false}, {"damaged", true}, {"kept", false}});
  EXPECT_EQ(chosenTraces(reply, {.state = "finished"}).size(), 2U);
  EXPECT_EQ(chosenTraces(reply, {.state = "damaged"}).size(), 1U);
  const std::string text = traceListText(reply["traces"], reply, kNow_ns, TerminalSize::kNoLimit);
  EXPECT_NE(text.find("damaged original\n"), std::string::npos) << text;
  EXPECT_EQ(deletionOf({name}, reply).to_delete.size(), 1U);
}

TEST(TraceList, SaysHowManyTracesWereLeftOut) {
  Json reply = kReply;
  reply["omitted"] = 7;
  const Json one = chosenTraces(reply, {.label = "left"});
  const std::string text = traceListText(one, reply, kNow_ns, TerminalSize::kNoLimit);
  EXPECT_NE(text.find("1 trace, 5.0 MB of 3 traces, 2.0 GB; hapticd lists the newest only and left out 7\n"),
            std::string::npos)
      << text;
}

TEST(TraceDeletion, ByAgeLeavesWhatIsKeptOrBeingWritten) {
  const TraceDeletion all = deletionBefore(kNow_ns, kReply);
  ASSERT_EQ(all.to_delete.size(), 1U);
  EXPECT_EQ(all.to_delete[0]["name"], "2026-03-04T04-06-07Z-right");
  EXPECT_EQ(all.staying,
            (std::vector<std::string>{"2026-03-03T05-06-07Z-left stays: it is kept or being written",
                                      "2026-03-04T05-06-00Z stays: it is kept or being written"}));
  EXPECT_TRUE(deletionBefore(kNow_ns - 48 * kHour_ns, kReply).to_delete.empty());
}

TEST(TraceDeletion, ByNameTakesEachOnceAndNamesWhatCannotGo) {
  const std::string right = "2026-03-04T04-06-07Z-right";
  EXPECT_EQ(deletionOf({right, right}, kReply).to_delete.size(), 1U);
  EXPECT_EQ(deletionOf({"2026-03-03T05-06-07Z-left", "2026-03-04T05-06-00Z", "x"}, kReply).problems.size(),
            3U);
}

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
