// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/plot/trace_plot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "tests/support/file_content.h"
#include "tests/support/made_up_trace.h"
#include "tests/support/temporary_folder.h"
#include "tools/lib/plot/gnuplot.h"

namespace hapticd::tools {
namespace {

constexpr std::int64_t kFirstTick_ns = 5'000'000'000;

std::int64_t after_ns(double seconds) {
  return kFirstTick_ns + static_cast<std::int64_t>(seconds * 1e9);
}

/// Two seconds: idle for one, then engaged with 3 N along x; a mark, a fault and a limit of 4 N.
test::MadeUpRecords experiment() {
  test::MadeUpRecords records;
  for (std::uint64_t number = 1; number <= 2000; ++number) {
    rt::Tick tick;
    tick.number = number;
    tick.planned_ns = kFirstTick_ns + static_cast<std::int64_t>(number - 1) * 1'000'000;
    tick.mode = number <= 1000 ? rt::Mode::idle : rt::Mode::engaged;
    if (number > 1500) tick.guidance_force_n_in_world = {0, 1, 0};
    if (number > 1000) tick.command_force_n_in_world = {3, 0, 0};
    records.ticks.push_back(tick);
  }
  records.directives.push_back({.time_ns = kFirstTick_ns - 1, .parameters = {{"safety.max_force_n", "4"}}});
  records.events.push_back({after_ns(-0.5), "mark", "too early", {{"MARK", "before the first tick"}}});
  records.events.push_back({after_ns(0.5), "mark", "uid 0 marks", {{"MARK", "trial 3: it's on"}}});
  records.events.push_back({after_ns(1.5), "mode", "faulted (handle_stale)", {{"MODE", "faulted"}}});
  records.events.push_back({after_ns(1.6), "parameter", "sets something", {}});
  return records;
}

class TracePlot : public testing::Test {
 protected:
  /// The SVG of a selection; empty where there is no gnuplot.
  std::string svgOf(const trace::TraceSelection& selection = {}) {
    test::writeTrace(folder_.path() / "a.mcap", experiment(), 1000);
    const auto plotted = plotTrace(folder_.path() / "a.mcap", folder_.path() / "a.svg", selection, {},
                                   base::IfExists::replace);
    if (!plotted) {
      EXPECT_NE(plotted.error().text().find("gnuplot-nox"), std::string::npos) << plotted.error().text();
      return "";
    }
    return test::contentOf(folder_.path() / "a.svg");
  }

  test::TemporaryFolder folder_;
};

TEST_F(TracePlot, ShowsModesForcesPerAxisTheirLimitAndEvents) {
  const std::string svg = svgOf();
  if (svg.empty()) GTEST_SKIP() << "no gnuplot here (Debian package gnuplot-nox)";
  for (const char* text : {">mode<", ">idle<", ">engaged<", ">force (N)<", ">force per axis (N)<", ">x<",
                           ">y<", ">z<", ">magnitude<", ">limit<", ">mark<", ">fault<", ">other event<",
                           ">wake-up latency (us)<", ">time since the first tick (s)<", "UTC; 2000 ticks"}) {
    EXPECT_NE(svg.find(text), std::string::npos) << text;
  }
  EXPECT_NE(svg.find("trial 3: it"), std::string::npos);
  EXPECT_NE(svg.find(">force of fixtures (N)<"), std::string::npos);
  EXPECT_NE(svg.find(">guidance<"), std::string::npos);
  EXPECT_NE(svg.find(">fixtures<"), std::string::npos);
  EXPECT_EQ(svg.find("before the first tick"), std::string::npos);
}

TEST_F(TracePlot, OfAStretchShowsOnlyWhatIsInIt) {
  const std::string svg = svgOf({.from_s = 1.2, .to_s = 1.4});
  if (svg.empty()) GTEST_SKIP() << "no gnuplot here (Debian package gnuplot-nox)";
  EXPECT_EQ(svg.find("trial 3"), std::string::npos);
  EXPECT_EQ(svg.find(">idle<"), std::string::npos);
  EXPECT_EQ(svg.find("force of fixtures"), std::string::npos) << "none acts in that time";
  EXPECT_EQ(svg.find(">fault<"), std::string::npos);
  EXPECT_NE(svg.find(">limit<"), std::string::npos) << "it was set before, and holds";
}

TEST(PlotScript, KeepsTextsFromActingAsCommands) {
  Plot plot;
  plot.title = "a'; system 'x";
  plot.last_s = 1;
  plot.panels.push_back({"force", "N", {{"x", "#000000", PlotCurve::Style::thin, {{0, 1}, {1, 2}}}}});
  plot.events.push_back({0.5, PlotEvent::Kind::mark, std::string(60, 'm') + "'\n"});
  const std::string script = plotScript(plot, "svg");
  EXPECT_NE(script.find("'a''; system ''x'"), std::string::npos);
  EXPECT_NE(script.find("'" + std::string(40, 'm') + "...'"), std::string::npos) << "long marks are cut";
}

TEST(PlotScript, DrawsALogarithmicAxisOnlyWhereAValueIsPositive) {
  for (const double largest : {0.0, 3.0}) {
    Plot plot;
    plot.last_s = 1;
    plot.panels.push_back(
        {"latency", "us", {{"x", "#000000", PlotCurve::Style::thin, {{0, 0}, {1, largest}}}}, true});
    EXPECT_EQ(plotScript(plot, "svg").find("\nset logscale y") != std::string::npos, largest > 0) << largest;
  }
}

TEST(PlotScript, FitsAPdfToTheTextOfAPage) {
  Plot plot;
  plot.last_s = 1;
  plot.panels.push_back({"force", "N", {{"x", "#000000", PlotCurve::Style::thin, {{0, 1}, {1, 2}}}}});
  EXPECT_NE(plotScript(plot, "pdfcairo").find("size 17cm,"), std::string::npos);
}

}  // namespace
}  // namespace hapticd::tools
