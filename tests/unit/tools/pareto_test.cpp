#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/temporary_folder.h"
#include "tools/hapticbench/pareto/cpu_cost.h"
#include "tools/hapticbench/pareto/fused_error.h"
#include "tools/hapticbench/pareto/laws_table.h"
#include "tools/hapticbench/pareto/pareto_plot.h"
#include "tools/hapticbench/pareto/pareto_report.h"
#include "tools/hapticbench/pareto/pareto_study.h"
#include "tools/hapticbench/pareto/readme_figures.h"
#include "tools/hapticbench/pareto/setting_error.h"
#include "tools/hapticbench/pareto/touching_path.h"

namespace hapticd::tools {
namespace {

using rt::ForceLaw;
using rt::Vec3;

TEST(CpuCost, IsThirtyFramesAndAThousandForcesPerSecond) {
  CostSamples samples;
  samples.model_ns = {100'000, 300'000};            // mean 200 us: 6 ms per second
  samples.force_ns = {1'000, 2'000, 3'000, 4'000};  // mean 2.5 us: 2.5 ms per second
  EXPECT_DOUBLE_EQ(CpuCost::of(samples).cpu_ms_per_s(), 8.5);
}

TEST(CpuCost, GivesMedianTailAndLargestOfTheForces) {
  CostSamples samples;
  for (int us = 2000; us >= 0; --us) samples.force_ns.push_back(us * 1000);
  const CpuCost cost = CpuCost::of(samples);
  EXPECT_DOUBLE_EQ(cost.force_median_us, 1000);
  EXPECT_DOUBLE_EQ(cost.force_p999_us, 1998);
  EXPECT_DOUBLE_EQ(cost.force_max_us, 2000);
}

TEST(CpuCost, OfNothingIsNothing) {
  EXPECT_EQ(CpuCost::of({}).cpu_ms_per_s(), 0);
}

TEST(CostSamples, KeepTheFastestOfEachSampleOfTwoRuns) {
  CostSamples kept{{5, 7}, {1, 9, 3}};
  kept.keepLeast({{6, 2}, {2, 4, 3}});
  EXPECT_EQ(kept.model_ns, (std::vector<std::int64_t>{5, 2}));
  EXPECT_EQ(kept.force_ns, (std::vector<std::int64_t>{1, 4, 3}));
}

TEST(TouchingPath, IsNowhereFasterThanItsSpeedAndGoesThroughTheSurface) {
  const Vec3 inward{0, 0.6, -0.8};
  const Vec3 surface{0.1, 0.2, -1};
  const std::vector<Vec3> path = touchingPath(surface, inward, 1000);
  double fastest_m = 0, deepest_m = -1, farthest_m = 1;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const double depth_m = dot(path[i] - surface, inward);
    deepest_m = std::max(deepest_m, depth_m);
    farthest_m = std::min(farthest_m, depth_m);
    if (i > 0) fastest_m = std::max(fastest_m, norm(path[i] - path[i - 1]));
  }
  EXPECT_LE(fastest_m, kPathSpeed_m_per_s / 1000);
  EXPECT_GT(fastest_m, 0.9 * kPathSpeed_m_per_s / 1000);
  // of 2 Hz at 1 kHz every 500th tick and so the very turning points are there
  EXPECT_NEAR(deepest_m, 0.015, 1e-5);
  EXPECT_NEAR(farthest_m, -0.035, 1e-5);
}

TEST(ReadmeFigures, ReplaceWhatIsBetweenTheMarksAndNothingElse) {
  const std::string before =
      "# hapticd\n<!-- figures: begin -->\nold\nolder\n<!-- figures: end -->\n## More\n";
  const auto after = withFigures(before, "| new |\n", "README.md");
  ASSERT_TRUE(after);
  EXPECT_EQ(*after, "# hapticd\n<!-- figures: begin -->\n| new |\n<!-- figures: end -->\n## More\n");
  EXPECT_EQ(*withFigures(*after, "| new |\n", "README.md"), *after);
}

TEST(ReadmeFigures, RefuseATextWithoutOnePlaceForThem) {
  const std::string begin(kFiguresBegin), end(kFiguresEnd);
  for (const std::string& text :
       {std::string("# no marks\n"), begin + "\n", end + "\n", end + "\n" + begin + "\n",
        begin + "\n" + begin + "\n" + end + "\n", begin + "\n" + end + "\n" + end + "\n"}) {
    const auto refused = withFigures(text, "new\n", "README.md");
    ASSERT_FALSE(refused) << text;
    EXPECT_EQ(refused.error().where, "README.md");
  }
}

TEST(ReadmeFigures, LeaveAFileWithoutMarksAsItIs) {
  const test::TemporaryFolder folder;
  const auto file = folder.write("README.md", "# no marks\n");
  EXPECT_FALSE(putFigures(file, "new\n"));
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  EXPECT_EQ(text.str(), "# no marks\n");
  EXPECT_FALSE(putFigures(folder.path() / "none.md", "new\n"));
}

TEST(LawsTable, HasOneSortedInitialiserPerLineUnderItsCommand) {
  const LawSetting springs{};
  const LawSetting surface{ForceLaw::surface, 0.005, true, 1};
  const std::string table = lawsTable(
      {{surface, 3.5, 0.00189, 1.871}, {surface, 0.8, 0.0002551, 5.644}, {springs, 1, 0.03364, 2.26}},
      "tools/figures");
  EXPECT_EQ(table,
            "// Written by `tools/figures`.\n"
            "// law, voxel edge m, filtered, distance m, RMS force error over stiffness m, CPU ms per second "
            "of use\n"
            "{rt::ForceLaw::nearest_springs, 0.01, false, 1.0, 0.033640, 2.26},\n"
            "{rt::ForceLaw::surface, 0.005, true, 0.8, 0.000255, 5.64},\n"
            "{rt::ForceLaw::surface, 0.005, true, 3.5, 0.001890, 1.87},\n");
}

TEST(LawsTable, HoldsEveryLawWithTheSettingsThatItReads) {
  const std::vector<LawSetting> settings = tableSettings();
  EXPECT_EQ(settings.size(), 2U + 2U + 3U * 2U);  // springs, proxy filtered or not, surface of three edges
  EXPECT_TRUE(std::is_sorted(settings.begin(), settings.end()));
  for (const LawSetting& setting : settings) {
    EXPECT_EQ(setting.fusion_frames, 1);
    if (setting.law != ForceLaw::surface) {
      EXPECT_EQ(setting.voxel_edge_m, kUsualVoxelEdge_m);
    }
  }
}

TEST(LawsTable, IsMeasuredForEverySettingAtEveryDistance) {
  const std::vector<LawAtDistance> rows =
      measureLaws({.distances_m = {0.8, 2}, .seconds = 0.07, .repeats = 1, .pushes = 1});
  EXPECT_EQ(rows.size(), 2 * tableSettings().size());
  for (const LawAtDistance& row : rows) {
    EXPECT_GT(row.error_m, 0) << nameOf(row.setting);
    EXPECT_LT(row.error_m, 0.045) << nameOf(row.setting);  // springs push the wrong way by at most D_thresh,
                                                           // and the errors go 20 mm deep
    EXPECT_GT(row.cpu_ms_per_s, 0) << nameOf(row.setting);
  }
}

TEST(FollowedError, IsThatOfTheAccuracyStudyWithoutFusion) {
  const std::vector<std::string> scenes{"sphere", "moving_0.5"};
  const LawSetting filtered{ForceLaw::surface, 0.02, true, 1};
  const LawSetting plain{ForceLaw::surface, 0.02, false, 1};
  const ErrorsOfSettings study = errorsOf({filtered, plain}, scenes, 1, 1);
  for (const LawSetting& setting : {filtered, plain}) {
    const ForceErrors followed = followedError(setting, scenes, 1, 1);
    EXPECT_EQ(followed.error_n.count(), study.at(setting).error_n.count());
    EXPECT_DOUBLE_EQ(followed.error_jnd.rms(), study.at(setting).error_jnd.rms());
  }
}

/// A short whole run without recordings.
const ParetoResult& shortRun() {
  static const ParetoResult result = [] {
    ParetoOptions options;
    options.recordings = "/nonexistent";
    options.settings = {{}, {ForceLaw::surface, 0.01, true, 8}};
    options.cost = {.seconds = 0.1, .repeats = 2, .checks = 3};
    options.evaluations = 40;
    options.pushes = 1;
    options.hard_frames = false;
    return measurePareto(options).value();
  }();
  return result;
}

TEST(Pareto, PutsEverySettingAndEveryLibraryBesideTheOthers) {
  const ParetoResult& result = shortRun();
  ASSERT_EQ(result.points.size(), 2 + libraries().size());
  EXPECT_GE(libraries().size(), 3U);
  for (const ParetoPoint& point : result.points) {
    EXPECT_EQ(point.run.samples.force_ns.size(), 100U) << point.run.kind.name;
    EXPECT_EQ(point.run.samples.model_ns.size(), 3U) << point.run.kind.name;  // 100 ms at 30 Hz
    EXPECT_GT(point.error.error_jnd.rms(), 0) << point.run.kind.name;
  }
}

TEST(Pareto, FindsTheSameForcesWithEveryWayToThePapersLaw) {
  // single precision at 1 m is 6e-8 m, times k_s is 3e-5 N; the libraries round point and HIP
  for (const ParetoPoint& point : shortRun().points) {
    if (!point.run.kind.is_paper_law) continue;
    EXPECT_GE(point.run.largest_difference_n, 0) << point.run.kind.name;
    EXPECT_LT(point.run.largest_difference_n, 1e-4) << point.run.kind.name;
    EXPECT_GT(point.run.contacts, 0) << point.run.kind.name;
  }
}

TEST(Pareto, ReportsTheSameFiguresForPeopleProgramsAndTheReadme) {
  const ParetoResult& result = shortRun();
  const auto document = nlohmann::json::parse(paretoJson(result, 1));
  EXPECT_EQ(document.at("points").size(), result.points.size());
  EXPECT_EQ(document.at("evaluations").size(), 2U);
  const std::string table = paretoTable(result, 1);
  const std::string markdown = paretoMarkdown(result, "docs/pareto.svg");
  EXPECT_EQ(markdown.rfind("![CPU time per second of use against force error](docs/pareto.svg)\n", 0), 0U);
  for (const ParetoPoint& point : result.points) {
    EXPECT_NE(table.find(point.run.kind.name), std::string::npos);
    EXPECT_NE(markdown.find("| " + point.run.kind.name + " |"), std::string::npos);
  }
  EXPECT_EQ(paretoMarkdown(result, "").find("!["), std::string::npos);
}

TEST(Pareto, DrawsEveryPointOnce) {
  const std::string script = plotScript(shortRun(), "it's.svg");
  EXPECT_NE(script.find("set terminal svg"), std::string::npos);
  EXPECT_NE(script.find("set logscale xy"), std::string::npos);
  EXPECT_NE(script.find("title 'surface, filtered, 8 fused'"), std::string::npos);
  EXPECT_NE(script.find("\"nanoflann\"\n"), std::string::npos);
  EXPECT_NE(script.find("\"10\"\n"), std::string::npos);
}

TEST(Pareto, SaysWhichRequirementIsNotKept) {
  ParetoResult result;
  result.evaluations = {{"scene", true, 10, 0.5, 0.25}, {"scene", false, 10, 2.5, 0.1}};
  result.hard_frames = {{"frame", "law", 150, 900}, {"frame", "other law", 210, 900}};
  const auto requirements = requirementsOf(result);
  ASSERT_EQ(requirements.size(), 4U);
  EXPECT_DOUBLE_EQ(requirements[0].measured, 40);  // surface, the least of both motions
  EXPECT_FALSE(requirements[0].kept());
  EXPECT_DOUBLE_EQ(requirements[1].measured, 4);  // unrelated
  EXPECT_FALSE(requirements[1].kept());
  EXPECT_DOUBLE_EQ(requirements[2].measured, 20);  // along the path
  EXPECT_TRUE(requirements[2].kept());
  EXPECT_DOUBLE_EQ(requirements[3].measured, 21);  // per cent of 1000 us
  EXPECT_FALSE(requirements[3].kept());
}

}  // namespace
}  // namespace hapticd::tools
