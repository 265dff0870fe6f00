// SPDX-License-Identifier: Apache-2.0
// The whole way from a scene to the rows of the report, on few scenes and small numbers.

#include "tools/hapticbench/accuracy/accuracy_study.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tools/hapticbench/accuracy/accuracy_report.h"
#include "tools/hapticbench/accuracy/accuracy_scene.h"
#include "tools/hapticbench/accuracy/accuracy_summary.h"
#include "tools/hapticbench/accuracy/course.h"

namespace hapticd::tools {
namespace {

using rt::ForceLaw;

AccuracyOptions small(std::vector<std::string> scenes, std::vector<ForceLaw> laws,
                      std::vector<SceneNoise> noises) {
  AccuracyOptions options;
  options.scenes = std::move(scenes);
  options.laws = std::move(laws);
  options.distances_m = {1};
  options.noises = std::move(noises);
  options.filters = {false};
  options.pushes = 1;
  options.hold_frames = 4;
  return options;
}

TEST(Course, GoesFromInFrontOfTheSurfaceToBehindItAtOneTenthOfAMillimetrePerTick) {
  const TrueScene scene = accuracyScenes().front().at(1, SceneNoise::none, 1);
  for (const Course& course : pushes(scene, 500, 3, 1)) {
    EXPECT_NEAR(course.ticks.front().depth_m, -0.03, 1e-9);
    EXPECT_NEAR(course.ticks.back().depth_m, kDeepest_m, 0.00011);
    EXPECT_EQ(course.ticks.front().frame, kSettlingFrames);
    EXPECT_EQ(course.ticks[34].frame, kSettlingFrames + 1);  // 30 frames in 1000 ticks
    const auto samples = std::count_if(course.ticks.begin(), course.ticks.end(), [](const CourseTick& tick) {
      return tick.sample == SamplePlace::behind;
    });
    EXPECT_NEAR(static_cast<double>(samples), 16, 1);  // 5, 6, ... 20 mm
    for (const CourseTick& tick : course.ticks) {
      EXPECT_NEAR(norm(tick.ideal_force_n), 500 * std::max(tick.depth_m, 0.0), 1e-9);
    }
  }
}

TEST(Course, EndsWhereABodyLetsAnIdealConstraintGo) {
  const AccuracyScene cylinder =
      *std::find_if(accuracyScenes().begin(), accuracyScenes().end(),
                    [](const AccuracyScene& scene) { return scene.name == "cylinder"; });
  const TrueScene scene = cylinder.at(1, SceneNoise::none, 1);
  for (const Course& course : pushes(scene, 500, 3, 1)) {
    // a cylinder of 20 mm radius holds at most 10 N, and less beside its middle
    EXPECT_LT(course.ticks.back().depth_m, 0.02);
    EXPECT_GT(course.ticks.back().depth_m, 0.01);
  }
}

TEST(Course, OfAComingPlaneFollowsItsFrames) {
  const AccuracyScene moving =
      *std::find_if(accuracyScenes().begin(), accuracyScenes().end(),
                    [](const AccuracyScene& scene) { return scene.name == "moving_0.5"; });
  const TrueScene scene = moving.at(1, SceneNoise::none, 1);
  const Course wait = waitForPlane(scene, 500, 1);
  EXPECT_NEAR(wait.ticks.front().depth_m, -0.02, 1e-9);
  // after three frames of 1/30 s at 0.5 m/s
  EXPECT_NEAR(wait.ticks.back().depth_m, -0.02 + 3 * 0.5 / 30, 1e-9);
  const Course press = pressThenPlane(scene, 500, 1);
  EXPECT_NEAR(press.ticks.back().depth_m, 0.01 + 2 * 0.5 / 30,
              1e-9);  // one frame more is deeper than kDeepest_m
}

TEST(AccuracyStudy, FindsThePopThroughForceOfThePapersLawWithinThreePercentOfTheClosedForm) {
  AccuracyOptions options = small({"plane"}, {ForceLaw::nearest_springs}, {SceneNoise::none});
  options.distances_m = {0.8, 1, 2};
  options.hold_frames = 0;
  const std::vector<AccuracyRow> rows = measureAccuracy(options);
  // maxima of k h (2 D / (h + S) - 1) with the camera's density of pixels
  const std::vector<double> closed_form_n{12.82, 11.81, 7.92};
  ASSERT_EQ(rows.size(), closed_form_n.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_NEAR(rows[i].pops.least_force_n, closed_form_n[i], 0.03 * closed_form_n[i]) << rows[i].distance_m;
    EXPECT_EQ(rows[i].pops.popped, 1);
    EXPECT_LT(rows[i].pops.depth_at_least_force_mm, 0);  // in front of the surface
  }
}

TEST(AccuracyStudy, MeasuresTheSpringsOfThePaperAgainstTheLawAndAgainstTheSurface) {
  const auto rows = measureAccuracy(small({"sphere"}, {ForceLaw::nearest_springs}, {SceneNoise::none}));
  ASSERT_EQ(rows.size(), 1U);
  // against itself: what rounding to 0.1 mm does to 100 springs of up to 20 N and to the choice of points
  EXPECT_LT(rows[0].against_law.error_n.max(), 0.2);
  // behind the surface it pulls the hand on
  EXPECT_GT(rows[0].against_surface.direction_deg.rms(), 150);
  EXPECT_GT(rows[0].against_surface.error_percent.rms(), 100);
}

TEST(AccuracyStudy, AStillSceneWithoutNoiseHasNoStepsAtNewFrames) {
  const auto rows = measureAccuracy(small({"plane"}, {ForceLaw::nearest_springs, ForceLaw::surface},
                                          {SceneNoise::none, SceneNoise::sensor}));
  ASSERT_EQ(rows.size(), 4U);
  for (const AccuracyRow& row : rows) {
    ASSERT_TRUE(row.held);
    if (row.noise == SceneNoise::none) {
      EXPECT_LT(row.law_step_n, 1e-6) << nameOf(row.law);
    } else {
      // the law surface looks at a mean over 16 frames, whose steps are a sixteenth of those of the newest
      // frame
      EXPECT_GT(row.law_step_n, row.law == ForceLaw::surface ? 0.01 / 16 : 0.01) << nameOf(row.law);
      EXPECT_LT(row.blended_step_n, row.law_step_n) << nameOf(row.law);
    }
  }
}

TEST(AccuracyStudy, GivesTheSameFiguresAgain) {
  const AccuracyOptions options = small({"edge"}, {kAllLaws.begin(), kAllLaws.end()}, {SceneNoise::sensor});
  EXPECT_EQ(accuracyJson(measureAccuracy(options)), accuracyJson(measureAccuracy(options)));
}

TEST(AccuracySummary, PutsTheScenesOfALawAndSettingTogether) {
  AccuracyRow first;
  first.law = ForceLaw::surface;
  first.pops.pushes = 2;
  first.pops.least_force_n = 21;
  first.against_surface.add({0, 0, 6}, {0, 0, 5});
  AccuracyRow second = first;
  second.scene = "other";
  second.pops.least_force_n = 4;
  second.pops.popped_under = {0, 1, 1};
  AccuracyRow other_setting = first;
  other_setting.filtered = true;
  const auto summaries = summaryOf({first, second, other_setting});
  ASSERT_EQ(summaries.size(), 2U);
  EXPECT_EQ(summaries[0].pops.pushes, 4);
  EXPECT_EQ(summaries[0].pops.least_force_n, 4);
  EXPECT_EQ(summaries[0].pops.popped_under[1], 1);
  EXPECT_EQ(summaries[0].against_surface.error_n.count(), 2U);
  EXPECT_TRUE(summaries[1].filtered);
}

TEST(AccuracySummary, NamesARowThatPopsThrough) {
  AccuracyRow row;
  row.law = ForceLaw::surface;
  row.scene = "bowl";
  row.pops.pushes = 1;
  row.pops.least_force_n = 30;
  const auto violationsOf = [&row] {
    for (const Requirement& requirement : requirementsOf({row})) {
      if (requirement.text.starts_with("surface: no pop-through")) return requirement.violations;
    }
    return std::vector<std::string>{"not checked"};
  };
  EXPECT_TRUE(violationsOf().empty());
  row.pops.popped_under = {0, 0, 1};
  ASSERT_EQ(violationsOf().size(), 1U);
  EXPECT_NE(violationsOf().front().find("bowl"), std::string::npos);
}

}  // namespace
}  // namespace hapticd::tools
