// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <map>
#include <string>
#include <vector>

#include "daemon/trace/export/selected_trace.h"
#include "daemon/trace/export/trace_export.h"
#include "daemon/trace/export/trace_summary.h"
#include "tests/support/file_content.h"
#include "tests/support/made_up_trace.h"
#include "tests/support/temporary_folder.h"
#include "tools/lib/plot/trace_plot.h"

namespace hapticd::trace {
namespace {

namespace fs = std::filesystem;
using test::contentOf;

// Exported traces, read without the code that wrote them.

using Rows = std::vector<std::vector<std::string>>;

/// Returns the fields of a CSV file by RFC 4180.
Rows rowsOf(const std::filesystem::path& csv) {
  Rows rows(1, {""});
  bool quoted = false;
  const std::string text = contentOf(csv);
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '"' && quoted && text[i + 1] == '"') {
      rows.back().back() += text[i++];
    } else if (text[i] == '"') {
      quoted = !quoted;
    } else if (text[i] == ',' && !quoted) {
      rows.back().emplace_back();
    } else if (text[i] == '\n' && !quoted) {
      rows.emplace_back(1, "");
    } else {
      rows.back().back() += text[i];
    }
  }
  rows.pop_back();  // behind the last line's end
  return rows;
}

/// The value of a row by the name of its column.
std::string cell(const Rows& rows, std::size_t row, const std::string& column) {
  const auto found = std::ranges::find(rows.at(0), column);
  if (found == rows[0].end()) return "no column " + column;
  return rows.at(row).at(static_cast<std::size_t>(found - rows[0].begin()));
}

double number(const Rows& rows, std::size_t row, const std::string& column) {
  return std::strtod(cell(rows, row, column).c_str(), nullptr);
}

constexpr std::int64_t kStart_ns = 5'000'000'000;
constexpr std::int64_t kRealtimeOffset_ns = 1'700'000'000'000'000'001;
constexpr const char* kSettings =
    "force:\n  law: \"proxy\"\n  radius_m: 0.04\n  max_points: 100\ntrace:\n  flight_recorder_s: 10\n"
    "safety:\n  engage_inside: true\nhandle:\n  serial: \"0042\"\n";

bool same(double a, double b) {
  return (std::isnan(a) && std::isnan(b)) || std::memcmp(&a, &b, sizeof a) == 0;
}

/// Ticks 1 ms apart from kStart_ns on; tick n has force n mod 7, and 9 where there is a peak.
rt::Tick plainTick(std::uint64_t number, const std::vector<std::uint64_t>& peaks) {
  rt::Tick tick;
  tick.number = number;
  tick.planned_ns = kStart_ns + static_cast<std::int64_t>(number - 1) * 1'000'000;
  const bool peak = std::ranges::find(peaks, number) != peaks.end();
  tick.command_force_n_in_world = {0, 0, peak ? -9.0 : static_cast<double>(number % 7)};
  tick.wakeup_latency_ns = static_cast<std::int64_t>(number) * 1000;
  tick.compute_ns = 2 * tick.wakeup_latency_ns;
  return tick;
}

bool lacksGnuplot(const base::Result<void>& plotted) {
  return !plotted && plotted.error().text().find("gnuplot-nox") != std::string::npos;
}

class TraceTools : public testing::Test {
 protected:
  fs::path path(const std::string& name) const { return folder_.path() / name; }

  fs::path write(const test::MadeUpRecords& records, const std::string& settings = kSettings) {
    TraceOptions options{.realtime_offset_ns = kRealtimeOffset_ns, .metadata = {{"kernel", "6.10"}}};
    if (!settings.empty()) options.attachments = {{"settings.yaml", "application/yaml", settings}};
    test::writeTrace(path("a.mcap"), records, 1000, options);
    return path("a.mcap");
  }
  fs::path writePlain(std::uint64_t ticks, const std::vector<std::uint64_t>& peaks = {}) {
    test::MadeUpRecords records;
    for (std::uint64_t number = 1; number <= ticks; ++number)
      records.ticks.push_back(plainTick(number, peaks));
    return write(records);
  }

  test::TemporaryFolder folder_;
};

TEST(Peaks, KeepTheLeastAndTheLargestOfEachStretchInOrder) {
  std::vector<int> kept;
  const std::vector<double> values{3, 1, 2, 9, 5, 5, 5, 5, 0, 7, 8, 4};
  Peaks<int> peaks(values.size(), 6, [&kept](int index) { kept.push_back(index); });
  for (int i = 0; i < 12; ++i) peaks.add(values[static_cast<std::size_t>(i)], i);
  peaks.finish();
  EXPECT_EQ(kept, (std::vector<int>{1, 3, 4, 8, 10}));  // 1 and 9, 5 for all, 0 and 8
}

TEST(Peaks, LoseNoValueThatIsNoNumberAndAreNeverTooMany) {
  for (const std::size_t most : {2U, 3U, 10U, 99U, 100U, 1000U}) {
    std::vector<double> kept;
    Peaks<double> peaks(100, most, [&kept](double value) { kept.push_back(value); });
    for (int i = 0; i < 100; ++i) {
      const double value = i == 57 ? std::nan("") : static_cast<double>(i * 37 % 100);
      peaks.add(value, value);
    }
    peaks.finish();
    EXPECT_LE(kept.size(), most);
    EXPECT_TRUE(std::ranges::any_of(kept, [](double value) { return std::isnan(value); })) << most;
    EXPECT_TRUE(std::ranges::find(kept, 0.0) != kept.end()) << most;
  }
}

TEST_F(TraceTools, CsvHasEveryTickAsItWasWritten) {
  const test::MadeUpRecords records = test::madeUpRecords(1, 50);
  const auto written = exportCsv(write(records), path("a.csv"), TraceChannel::ticks);
  ASSERT_TRUE(written) << written.error().text();
  EXPECT_EQ(*written, 50U);
  const Rows rows = rowsOf(path("a.csv"));
  ASSERT_EQ(rows.size(), 51U);
  for (std::size_t i = 0; i < 50; ++i) {
    const rt::Tick& tick = records.ticks[i];
    const std::size_t row = i + 1;
    ASSERT_EQ(rows[row].size(), rows[0].size());
    EXPECT_EQ(cell(rows, row, "number"), std::to_string(tick.number));
    EXPECT_EQ(cell(rows, row, "wakeup_latency_ns"), std::to_string(tick.wakeup_latency_ns));
    EXPECT_EQ(cell(rows, row, "handle_buttons"), std::to_string(tick.handle.buttons));
    EXPECT_EQ(cell(rows, row, "slew_limited"), tick.slew_limited ? "1" : "0");
    EXPECT_TRUE(same(number(rows, row, "energy_j"), tick.energy_j));
    EXPECT_TRUE(same(number(rows, row, "command_force_n_in_world_x"), tick.command_force_n_in_world.x));
    EXPECT_TRUE(same(number(rows, row, "command_force_n_in_world_z"), tick.command_force_n_in_world.z));
    EXPECT_TRUE(same(number(rows, row, "handle_velocity_m_per_s_in_world_y"),
                     tick.handle.velocity_m_per_s_in_world.y));
  }
}

TEST_F(TraceTools, CsvSaysTimesExactlyAndEnumeratorsByName) {
  test::MadeUpRecords records;
  records.ticks = {plainTick(1, {}), plainTick(2, {})};
  records.ticks[1].mode = rt::Mode::engaged;
  records.ticks[1].cause = rt::Cause::overrun_burst;
  records.ticks[1].law = rt::ForceLaw::surface;
  ASSERT_TRUE(exportCsv(write(records), path("a.csv"), TraceChannel::ticks));
  const Rows rows = rowsOf(path("a.csv"));
  EXPECT_EQ(cell(rows, 1, "time_s"), "0.000000000");
  EXPECT_EQ(cell(rows, 2, "time_s"), "0.001000000");
  EXPECT_EQ(cell(rows, 2, "realtime_s"), "1700000005.001000001");
  EXPECT_EQ(cell(rows, 1, "mode"), "starting");
  EXPECT_EQ(cell(rows, 2, "mode"), "engaged");
  EXPECT_EQ(cell(rows, 2, "cause"), "overrun_burst");
  EXPECT_EQ(cell(rows, 2, "law"), "surface");
}

TEST_F(TraceTools, CsvHasTheOtherChannels) {
  test::MadeUpRecords records;
  EventRecord event;
  event.time_ns = kStart_ns - 500'000'000;
  event.kind = "warning";
  event.text = "a \"quoted\", long\nline";
  event.fields = {{"A", "1"}, {"B", "x, y"}};
  records.events = {event};
  ModelRecord model;
  model.centre_m_in_world = {0.5, 0, -1.25};
  records.models = {model, model};
  records.directives.emplace_back().parameters = {{"force.law", "surface"}};
  records.ticks = {plainTick(1, {})};
  const fs::path trace = write(records);
  ASSERT_TRUE(exportCsv(trace, path("events.csv"), TraceChannel::events));
  const Rows events = rowsOf(path("events.csv"));
  EXPECT_EQ(cell(events, 1, "time_s"), "-0.500000000");  // before the first tick
  EXPECT_EQ(cell(events, 1, "text"), event.text);
  EXPECT_EQ(cell(events, 1, "fields"), "A=1; B=x, y");
  EXPECT_EQ(exportCsv(trace, path("models.csv"), TraceChannel::models).value(), 2U);
  EXPECT_EQ(cell(rowsOf(path("models.csv")), 2, "centre_m_in_world_z"), "-1.25");
  EXPECT_EQ(exportCsv(trace, path("directives.csv"), TraceChannel::directives).value(), 1U);
  EXPECT_EQ(cell(rowsOf(path("directives.csv")), 1, "force.law"), "surface");
}

TEST_F(TraceTools, CsvOfAnOlderTraceHasTheColumnsThatTheTraceHas) {
  test::writeOlderTrace(path("older.mcap"), {plainTick(1, {}), plainTick(2, {2})});
  const auto rows_written = exportCsv(path("older.mcap"), path("older.csv"), TraceChannel::ticks);
  ASSERT_TRUE(rows_written) << rows_written.error().text();
  const Rows rows = rowsOf(path("older.csv"));
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[1].size(), rows[0].size());
  EXPECT_EQ(number(rows, 2, "command_force_n_in_world_z"), -9);
  EXPECT_EQ(cell(rows, 1, "slewed_force_n_in_world_x"), "no column slewed_force_n_in_world_x");
}

TEST_F(TraceTools, OnlyTheSelectedTimeIsExported) {
  const fs::path trace = writePlain(100);
  const auto written = exportCsv(trace, path("a.csv"), TraceChannel::ticks, {.from_s = 0.0095, .to_s = 0.02});
  ASSERT_TRUE(written) << written.error().text();
  const Rows rows = rowsOf(path("a.csv"));
  EXPECT_EQ(*written, 11U);
  EXPECT_EQ(cell(rows, 1, "number"), "11");
  EXPECT_EQ(cell(rows, 11, "number"), "21");
}

TEST_F(TraceTools, FewerRowsKeepEveryPeak) {
  const std::vector<std::uint64_t> peaks{1, 137, 500, 999, 1000};
  const auto written =
      exportCsv(writePlain(1000, peaks), path("a.csv"), TraceChannel::ticks, {.most_ticks = 40});
  ASSERT_TRUE(written) << written.error().text();
  EXPECT_LE(*written, 40U);
  EXPECT_GE(*written, 38U);
  const Rows rows = rowsOf(path("a.csv"));
  std::vector<std::uint64_t> found;
  std::uint64_t before = 0;
  for (std::size_t row = 1; row < rows.size(); ++row) {
    const std::uint64_t tick = std::stoull(cell(rows, row, "number"));
    EXPECT_GT(tick, before) << "in the order of time";
    before = tick;
    if (number(rows, row, "command_force_n_in_world_z") == -9) found.push_back(tick);
  }
  EXPECT_EQ(found, (std::vector<std::uint64_t>{1, 137, 500, 999}));  // the last two are of one stretch
}

TEST_F(TraceTools, NothingIsLeftOfWhatCouldNotBeExported) {
  const fs::path trace = writePlain(5000);
  std::string damaged = contentOf(trace);
  damaged[damaged.size() * 6 / 10] ^= 1;
  folder_.write("damaged.mcap", damaged);
  const auto filesBefore = std::distance(fs::directory_iterator(folder_.path()), {});
  for (const char* source : {"damaged.mcap", "none.mcap"}) {
    EXPECT_FALSE(exportCsv(path(source), path("a.csv"), TraceChannel::ticks)) << source;
    EXPECT_FALSE(tools::plotTrace(path(source), path("a.svg"))) << source;
    EXPECT_FALSE(summariseTrace(path(source))) << source;
  }
  for (const TraceSelection& none :
       {TraceSelection{.from_s = 2, .to_s = 1}, TraceSelection{.from_s = std::nan("")},
        TraceSelection{.most_ticks = 1}}) {
    EXPECT_FALSE(exportCsv(trace, path("a.csv"), TraceChannel::ticks, none));
  }
  EXPECT_FALSE(exportCsv(trace, path("nowhere/a.csv"), TraceChannel::ticks));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), {}), filesBefore);
}

TEST_F(TraceTools, NoFileIsOverwritten) {
  const fs::path trace = writePlain(5);
  for (const char* name : {"a.csv", "a.svg"}) folder_.write(name, "mine");
  EXPECT_FALSE(exportCsv(trace, path("a.csv"), TraceChannel::ticks));
  EXPECT_FALSE(tools::plotTrace(trace, path("a.svg")));
  for (const char* name : {"a.csv", "a.svg"}) EXPECT_EQ(contentOf(path(name)), "mine");
}

TEST_F(TraceTools, ProgressGrowsToTheEnd) {
  const fs::path trace = writePlain(5000);
  std::vector<double> shares;
  const auto note = [&shares](double share) { shares.push_back(share); };
  ASSERT_TRUE(exportCsv(trace, path("a.csv"), TraceChannel::ticks, {.most_ticks = 10}, note));
  EXPECT_GT(shares.size(), 4U);
  EXPECT_TRUE(std::ranges::is_sorted(shares));
  EXPECT_EQ(shares.back(), 1);
}

TEST_F(TraceTools, SummaryIsWhatTheTicksSay) {
  test::MadeUpRecords records;
  for (const std::uint64_t number : {1U, 2U, 3U, 4U, 7U, 8U, 11U})
    records.ticks.push_back(plainTick(number, {8}));
  records.ticks[2].mode = records.ticks[3].mode = rt::Mode::engaged;
  records.ticks[3].contact = rt::ContactState::contact;
  records.ticks[4].points_used = 12;
  records.ticks[5].after_overrun = true;
  records.ticks[1].fixtures_in_contact = 0b01;
  records.ticks[2].fixtures_in_contact = records.ticks[3].fixtures_in_contact = 0b11;
  records.ticks[5].fixtures_in_contact = 0b10;
  records.ticks[2].fixture_force_n_in_world = {0, 0, 1.5};
  records.ticks[3].guidance_force_n_in_world = {0.5, 0, 0};
  records.events.emplace_back().kind = "mode";
  const auto summary = summariseTrace(write(records));
  ASSERT_TRUE(summary) << summary.error().text();
  EXPECT_EQ(summary->info.ticks, 7U);
  EXPECT_EQ(summary->info.ticks_dropped, 4U);
  EXPECT_DOUBLE_EQ(summary->duration_s, 0.010);
  EXPECT_DOUBLE_EQ(summary->rate_hz, 1000);
  ASSERT_EQ(summary->gaps, 2U);
  EXPECT_EQ(summary->first_gaps[1].after_tick, 8U);
  EXPECT_EQ(summary->first_gaps[1].ticks, 2U);
  EXPECT_DOUBLE_EQ(summary->first_gaps[1].time_s, 0.007);
  EXPECT_EQ(summary->overruns, 1U);
  EXPECT_EQ(summary->wakeup_latency.median_us, 4);  // of 1 2 3 4 7 8 11
  EXPECT_EQ(summary->wakeup_latency.p99_us, 11);
  EXPECT_EQ(summary->compute_time.max_us, 22);
  EXPECT_EQ(summary->largest_force_n, 9);
  EXPECT_DOUBLE_EQ(summary->largest_force_time_s, 0.007);
  EXPECT_DOUBLE_EQ(summary->contact_share, 2.0 / 7);
  EXPECT_EQ(summary->fixture_contacts, 3U);
  EXPECT_DOUBLE_EQ(summary->fixture_contact_share, 4.0 / 7);
  EXPECT_EQ(summary->largest_fixture_force_n, 1.5);
  EXPECT_EQ(summary->largest_guidance_force_n, 0.5);
  ASSERT_EQ(summary->modes_s.size(), 2U);
  EXPECT_EQ(summary->modes_s[0].first, "starting");
  EXPECT_DOUBLE_EQ(summary->modes_s[0].second, 0.005);
  EXPECT_EQ(summary->modes_s[1].first, "engaged");
  EXPECT_DOUBLE_EQ(summary->modes_s[1].second, 0.002);
  EXPECT_EQ(summary->info.events, 1U);
}

TEST_F(TraceTools, SummaryOfATraceWithoutTicksIsEmpty) {
  const auto summary = summariseTrace(write({}));
  ASSERT_TRUE(summary) << summary.error().text();
  EXPECT_EQ(summary->duration_s, 0);
  EXPECT_EQ(summary->rate_hz, 0);
  EXPECT_TRUE(summary->modes_s.empty());
}

// Information derived from traces: periods without a tick, fields that a law does not have, settings.

/// A tick in that period of a millisecond.
rt::Tick tickAt(std::uint64_t number, std::int64_t period, rt::ForceLaw law = rt::ForceLaw::proxy) {
  rt::Tick tick;
  tick.number = number;
  tick.planned_ns = kStart_ns + period * 1'000'000;
  tick.law = law;
  tick.contact = rt::ContactState::free;
  tick.hip_m_in_world = tick.proxy_m_in_world = {0, 0, -1};
  tick.command_force_n_in_world = {0, 0, 4};
  return tick;
}

TEST_F(TraceTools, PeriodsWithoutATickAreCountedThoughNumbersHaveNoGap) {
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

TEST_F(TraceTools, TicksThatTheTraceLacksAreNoEmptyPeriods) {
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

TEST_F(TraceTools, TheSettingsSayThePeriodWhereNoTwoTicksAreOneApart) {
  test::MadeUpRecords records;
  for (std::int64_t i = 0; i < 5; ++i)
    records.ticks.push_back(tickAt(static_cast<std::uint64_t>(i + 1), 2 * i));
  const auto summary = summariseTrace(write(records, "loop:\n  rate_hz: 1000\n"));
  ASSERT_TRUE(summary);
  EXPECT_EQ(summary->empty_periods.periods, 9U);
  EXPECT_EQ(summary->empty_periods.empty, 4U);
}

TEST_F(TraceTools, InALawWithoutAProxyContactAndPenetrationDoNotApply) {
  test::MadeUpRecords records;
  records.ticks = {tickAt(1, 1, rt::ForceLaw::nearest_springs), tickAt(2, 2, rt::ForceLaw::surface)};
  records.ticks[1].contact = rt::ContactState::contact;
  const fs::path trace = write(records);

  ASSERT_TRUE(exportCsv(trace, path("a.csv"), TraceChannel::ticks));
  const Rows rows = rowsOf(path("a.csv"));
  EXPECT_EQ(cell(rows, 1, "contact"), "");
  EXPECT_EQ(cell(rows, 1, "proxy_m_in_world_z"), "");
  EXPECT_EQ(cell(rows, 1, "hip_m_in_world_z"), "-1");
  EXPECT_EQ(cell(rows, 2, "contact"), "contact");
  EXPECT_EQ(cell(rows, 2, "proxy_m_in_world_z"), "-1");
  EXPECT_EQ(rows[1].size(), rows[0].size());

  const auto summary = summariseTrace(trace);
  ASSERT_TRUE(summary);
  EXPECT_TRUE(summary->law_without_proxy);
  ASSERT_EQ(summary->laws_s.size(), 2U);
  EXPECT_EQ(summary->laws_s[0].first, "nearest_springs");
}

TEST_F(TraceTools, APlotDrawsNoPenetrationOfALawWithoutAProxy) {
  test::MadeUpRecords records;
  for (std::uint64_t i = 1; i < 50; ++i) {
    records.ticks.push_back(tickAt(i, static_cast<std::int64_t>(i), rt::ForceLaw::smooth_springs));
  }
  const auto plotted = tools::plotTrace(write(records), path("a.svg"));
  if (lacksGnuplot(plotted)) GTEST_SKIP() << plotted.error().text();
  ASSERT_TRUE(plotted) << plotted.error().text();
  const std::string image = contentOf(path("a.svg"));
  EXPECT_NE(image.find("a.mcap, of a law without a proxy: no penetration"), std::string::npos);
  EXPECT_EQ(image.find("penetration (mm)"), std::string::npos);
  EXPECT_NE(image.find("force (N)"), std::string::npos);
}

TEST_F(TraceTools, BesideACsvAreTheSettingsItWasRecordedWith) {
  test::MadeUpRecords records;
  records.ticks = {tickAt(1, 0)};
  const fs::path trace = write(records);
  ASSERT_TRUE(exportCsv(trace, path("a.csv"), TraceChannel::ticks));
  const std::string settings = contentOf(path("a.settings.yaml"));
  EXPECT_TRUE(settings.ends_with(kSettings)) << settings;
  EXPECT_NE(settings.find("# kernel: 6.10\n"), std::string::npos) << settings;

  folder_.write("b.settings.yaml", "mine");
  EXPECT_FALSE(exportCsv(trace, path("b.csv"), TraceChannel::ticks));
  EXPECT_FALSE(fs::exists(path("b.csv")));
  EXPECT_EQ(contentOf(path("b.settings.yaml")), "mine");
}

TEST_F(TraceTools, ParametersOfDirectivesAreColumnsOfACsv) {
  test::MadeUpRecords records;
  records.ticks = {tickAt(1, 0)};
  records.directives.resize(2);
  records.directives[0].parameters = {{"force.radius_m", "0.04"}};
  records.directives[1].parameters = {{"force.law", "proxy"}, {"safety.engage_inside", "false"}};
  ASSERT_TRUE(exportCsv(write(records), path("a.csv"), TraceChannel::directives));
  const Rows rows = rowsOf(path("a.csv"));
  EXPECT_EQ(cell(rows, 1, "force.radius_m"), "0.04");
  EXPECT_EQ(cell(rows, 1, "force.law"), "");
  EXPECT_EQ(cell(rows, 2, "force.radius_m"), "");
  EXPECT_EQ(cell(rows, 2, "force.law"), "proxy");
  EXPECT_EQ(cell(rows, 2, "safety.engage_inside"), "0");
}

/// $PATH for the life of the object.
class SearchPath {
 public:
  explicit SearchPath(const std::string& path) { ::setenv("PATH", path.c_str(), 1); }
  ~SearchPath() { ::setenv("PATH", before_.c_str(), 1); }

 private:
  std::string before_ = std::getenv("PATH");
};

TEST_F(TraceTools, PlotsAsTheEndingSays) {
  const fs::path trace = writePlain(3000, {1500});
  for (const auto& [name, begin] :
       std::map<std::string, std::string>{{"a.png", "\x89PNG"}, {"a.svg", "<?xml"}}) {
    const auto plotted = tools::plotTrace(trace, path(name));
    if (lacksGnuplot(plotted)) GTEST_SKIP() << plotted.error().text();
    ASSERT_TRUE(plotted) << plotted.error().text();
    EXPECT_TRUE(contentOf(path(name)).starts_with(begin)) << name;
  }
  EXPECT_NE(contentOf(path("a.svg")).find("force (N)"), std::string::npos);
  EXPECT_TRUE(tools::plotTrace(trace, path("b.svg"), {.from_s = 1, .to_s = 1})) << "one tick is enough";
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), {}), 4) << "nothing else is left";
}

TEST_F(TraceTools, PlotOfAnOlderTraceLeavesOutWhatTheTraceLacks) {
  const fs::path trace = path("older.mcap");
  test::writeOlderTrace(trace, {plainTick(1, {}), plainTick(2, {2})}, "command_force_n_in_world");
  const auto plotted = tools::plotTrace(trace, path("a.svg"));
  if (lacksGnuplot(plotted)) GTEST_SKIP() << plotted.error().text();
  ASSERT_TRUE(plotted) << plotted.error().text();
  const std::string image = contentOf(path("a.svg"));
  EXPECT_NE(image.find("older.mcap, of another version: no force,"), std::string::npos);
  EXPECT_EQ(image.find(">force (N)<"), std::string::npos);
  EXPECT_NE(image.find(">wake-up latency (us)<"), std::string::npos);
}

TEST_F(TraceTools, PlotSaysWhatIsMissing) {
  const fs::path trace = writePlain(10);
  const auto errorOf = [&](const char* image, const TraceSelection& selection) {
    const auto plotted = tools::plotTrace(trace, path(image), selection);
    return plotted ? std::string() : plotted.error().text();
  };
  EXPECT_NE(errorOf("a.jpg", {}).find(".png or .svg or .pdf"), std::string::npos);
  EXPECT_NE(errorOf("a.svg", {.from_s = 5}).find("no ticks"), std::string::npos);
  const SearchPath nothing(folder_.path().string());
  EXPECT_NE(errorOf("a.svg", {}).find("gnuplot-nox"), std::string::npos) << errorOf("a.svg", {});
  EXPECT_FALSE(fs::exists(path("a.svg")));
}

}  // namespace
}  // namespace hapticd::trace
