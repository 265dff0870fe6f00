// SPDX-License-Identifier: Apache-2.0
// Information derived from traces: periods without a tick, fields that a law does not have, settings.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "daemon/trace/export/trace_export.h"
#include "daemon/trace/export/trace_summary.h"
#include "tests/support/file_content.h"
#include "tests/support/made_up_trace.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/daemon/trace/exported_trace.h"
#include "tools/lib/plot/trace_plot.h"

namespace hapticd::trace {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kBegin_ns = 7'000'000'000;
constexpr const char* kSettings =
    "force:\n  law: \"proxy\"\n  radius_m: 0.04\n  max_points: 100\ntrace:\n  flight_recorder_s: 10\n"
    "safety:\n  engage_inside: true\nhandle:\n  serial: \"0042\"\n";

class TraceMeaning : public testing::Test {
 protected:
  fs::path path(const std::string& name) const { return folder_.path() / name; }

  /// A tick in that period of a millisecond.
  static rt::Tick tickAt(std::uint64_t number, std::int64_t period, rt::ForceLaw law = rt::ForceLaw::proxy) {
    rt::Tick tick;
    tick.number = number;
    tick.planned_ns = kBegin_ns + period * 1'000'000;
    tick.law = law;
    tick.contact = rt::ContactState::free;
    tick.hip_m_in_world = tick.proxy_m_in_world = {0, 0, -1};
    tick.command_force_n_in_world = {0, 0, 4};
    return tick;
  }
  fs::path write(const test::MadeUpRecords& records, const std::string& settings = kSettings) {
    TraceOptions options{.realtime_offset_ns = 1'700'000'000'000'000'000,
                         .metadata = {{"kernel", "6.10"}, {"force_thread_cpu", "3"}}};
    if (!settings.empty()) options.attachments = {{"settings.yaml", "application/yaml", settings}};
    test::writeTrace(path("a.mcap"), records, 1000, options);
    return path("a.mcap");
  }

  test::TemporaryFolder folder_;
};

TEST_F(TraceMeaning, PeriodsWithoutATickAreCountedThoughNumbersHaveNoGap) {
  test::MadeUpRecords records;
  // periods 0 1 2 . 4 . . . 8 9: numbered without a gap
  std::uint64_t number = 100;
  for (const std::int64_t period : {0, 1, 2, 4, 8, 9}) records.ticks.push_back(tickAt(number++, period));
  const auto summary = summariseTrace(write(records));
  ASSERT_TRUE(summary) << summary.error().text();
  EXPECT_EQ(summary->gaps, 0U);
  const EmptyPeriods& periods = summary->empty_periods;
  EXPECT_EQ(periods.period_ns, 1'000'000);
  EXPECT_EQ(periods.periods, 10U);
  EXPECT_EQ(periods.empty, 4U);
  EXPECT_EQ(periods.stretches, 2U);
  EXPECT_EQ(periods.longest, 3U);
  EXPECT_EQ(periods.after_tick, 103U);
  EXPECT_DOUBLE_EQ(summary->longest_empty_time_s, 0.004);
}

TEST_F(TraceMeaning, TicksThatTheTraceLacksAreNoEmptyPeriods) {
  test::MadeUpRecords records;
  // from 2 to 9 five ticks are missing in the trace, and one of those periods had none
  for (const auto& [number, period] : {std::pair(1, 1), {2, 2}, {8, 9}, {9, 10}}) {
    records.ticks.push_back(tickAt(static_cast<std::uint64_t>(number), period));
  }
  const auto summary = summariseTrace(write(records));
  ASSERT_TRUE(summary);
  EXPECT_EQ(summary->info.ticks_dropped, 5U);
  EXPECT_EQ(summary->empty_periods.empty, 1U);
  EXPECT_EQ(summary->empty_periods.periods, 10U);
}

TEST_F(TraceMeaning, TheSettingsSayThePeriodWhereNoTwoTicksAreOneApart) {
  test::MadeUpRecords records;
  for (std::int64_t i = 0; i < 5; ++i)
    records.ticks.push_back(tickAt(static_cast<std::uint64_t>(i + 1), 2 * i));
  const auto summary = summariseTrace(write(records, "loop:\n  rate_hz: 1000\n"));
  ASSERT_TRUE(summary);
  EXPECT_EQ(summary->empty_periods.periods, 9U);
  EXPECT_EQ(summary->empty_periods.empty, 4U);
}

TEST_F(TraceMeaning, InALawWithoutAProxyContactAndPenetrationDoNotApply) {
  test::MadeUpRecords records;
  records.ticks = {tickAt(1, 1, rt::ForceLaw::nearest_springs), tickAt(2, 2, rt::ForceLaw::surface)};
  records.ticks[1].contact = rt::ContactState::contact;
  const fs::path trace = write(records);

  ASSERT_TRUE(exportCsv(trace, path("a.csv"), TraceChannel::ticks));
  const test::Rows rows = test::rowsOf(path("a.csv"));
  EXPECT_EQ(test::cell(rows, 1, "contact"), "");
  EXPECT_EQ(test::cell(rows, 1, "proxy_m_in_world_z"), "");
  EXPECT_EQ(test::cell(rows, 1, "hip_m_in_world_z"), "-1");
  EXPECT_EQ(test::cell(rows, 2, "contact"), "contact");
  EXPECT_EQ(test::cell(rows, 2, "proxy_m_in_world_z"), "-1");
  EXPECT_EQ(rows[1].size(), rows[0].size());

  const auto summary = summariseTrace(trace);
  ASSERT_TRUE(summary);
  EXPECT_TRUE(summary->law_without_proxy);
  ASSERT_EQ(summary->laws_s.size(), 2U);
  EXPECT_EQ(summary->laws_s[0].first, "nearest_springs");
}

TEST_F(TraceMeaning, APlotDrawsNoPenetrationOfALawWithoutAProxy) {
  test::MadeUpRecords records;
  for (std::uint64_t i = 1; i < 50; ++i) {
    records.ticks.push_back(tickAt(i, static_cast<std::int64_t>(i), rt::ForceLaw::smooth_springs));
  }
  const auto plotted = tools::plotTrace(write(records), path("a.svg"));
  if (!plotted && plotted.error().text().find("gnuplot-nox") != std::string::npos) {
    GTEST_SKIP() << "no gnuplot here (Debian package gnuplot-nox)";
  }
  ASSERT_TRUE(plotted) << plotted.error().text();
  const std::string image = test::contentOf(path("a.svg"));
  EXPECT_NE(image.find("a.mcap, of a law without a proxy: no penetration"), std::string::npos);
  EXPECT_EQ(image.find("penetration (mm)"), std::string::npos);
  EXPECT_NE(image.find("force (N)"), std::string::npos);
}

TEST_F(TraceMeaning, BesideACsvAreTheSettingsItWasRecordedWith) {
  test::MadeUpRecords records;
  records.ticks = {tickAt(1, 0)};
  const fs::path trace = write(records);
  ASSERT_TRUE(exportCsv(trace, path("a.csv"), TraceChannel::ticks));
  const std::string settings = test::contentOf(path("a.settings.yaml"));
  EXPECT_TRUE(settings.ends_with(kSettings)) << settings;
  EXPECT_NE(settings.find("# kernel: 6.10\n"), std::string::npos) << settings;

  folder_.write("b.settings.yaml", "mine");
  EXPECT_FALSE(exportCsv(trace, path("b.csv"), TraceChannel::ticks));
  EXPECT_FALSE(fs::exists(path("b.csv")));
  EXPECT_EQ(test::contentOf(path("b.settings.yaml")), "mine");
}

TEST_F(TraceMeaning, ParametersOfDirectivesAreColumnsOfACsv) {
  test::MadeUpRecords records;
  records.ticks = {tickAt(1, 0)};
  records.directives.resize(2);
  records.directives[0].parameters = {{"force.radius_m", "0.04"}};
  records.directives[1].parameters = {{"force.law", "proxy"}, {"safety.engage_inside", "false"}};
  ASSERT_TRUE(exportCsv(write(records), path("a.csv"), TraceChannel::directives));
  const test::Rows rows = test::rowsOf(path("a.csv"));
  EXPECT_EQ(test::cell(rows, 1, "force.radius_m"), "0.04");
  EXPECT_EQ(test::cell(rows, 1, "force.law"), "");
  EXPECT_EQ(test::cell(rows, 2, "force.radius_m"), "");
  EXPECT_EQ(test::cell(rows, 2, "force.law"), "proxy");
  EXPECT_EQ(test::cell(rows, 2, "safety.engage_inside"), "0");
}

}  // namespace
}  // namespace hapticd::trace
