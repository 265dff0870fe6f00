// SPDX-License-Identifier: Apache-2.0
// The whole study from scene to report, on few scenes and with small numbers.

#include "tools/hapticbench/accuracy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace hapticd::tools {
namespace {

using rt::ForceLaw;

AccuracyOptions small(std::vector<std::string> scenes, const std::vector<ForceLaw>& laws,
                      std::vector<SceneNoise> noises) {
  AccuracyOptions options;
  options.scenes = std::move(scenes);
  options.settings.clear();
  for (const ForceLaw law : laws) options.settings.push_back({.law = law});
  options.distances_m = {1};
  options.noises = std::move(noises);
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
    const auto samples = std::count_if(course.ticks.begin(), course.ticks.end(),
                                       [](const CourseTick& tick) { return tick.is_sample; });
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

TEST(AccuracyStudy, FindsThatTheSpringsOfThePaperPullTheHandOnBehindTheSurface) {
  const auto rows = measureAccuracy(small({"sphere"}, {ForceLaw::nearest_springs}, {SceneNoise::none}));
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_GT(rows[0].error.direction_deg.rms(), 150);
  EXPECT_GT(rows[0].error.error_percent.rms(), 100);
}

TEST(AccuracyStudy, AStillSceneWithoutNoiseHasNoStepsAtNewFrames) {
  const auto rows = measureAccuracy(small({"plane"}, {ForceLaw::nearest_springs, ForceLaw::surface},
                                          {SceneNoise::none, SceneNoise::sensor}));
  ASSERT_EQ(rows.size(), 4U);
  for (const AccuracyRow& row : rows) {
    ASSERT_TRUE(row.held);
    if (row.noise == SceneNoise::none) {
      EXPECT_LT(row.law_step_n, 1e-6) << nameOf(row.setting);
    } else {
      // the law surface looks at a mean over 16 frames, whose steps are a sixteenth of those of the newest
      // frame
      EXPECT_GT(row.law_step_n, row.setting.law == ForceLaw::surface ? 0.01 / 16 : 0.01)
          << nameOf(row.setting);
      EXPECT_LT(row.blended_step_n, row.law_step_n) << nameOf(row.setting);
    }
  }
}

TEST(AccuracyStudy, GivesTheSameFiguresAgain) {
  const AccuracyOptions options = small({"edge"}, everyOne<ForceLaw>(), {SceneNoise::sensor});
  EXPECT_EQ(accuracyReport(measureAccuracy(options)).json(), accuracyReport(measureAccuracy(options)).json());
}

TEST(AccuracySummary, PutsTheScenesOfALawAndSettingTogether) {
  AccuracyRow first;
  first.setting.law = ForceLaw::surface;
  first.pops.pushes = 2;
  first.pops.least_force_n = 21;
  first.error.add({0, 0, 6}, {0, 0, 5});
  AccuracyRow second = first;
  second.scene = "other";
  second.pops.least_force_n = 4;
  second.pops.popped_under = {0, 1, 1};
  AccuracyRow other_setting = first;
  other_setting.setting.filtered = true;
  const auto summaries = summaryOf({first, second, other_setting});
  ASSERT_EQ(summaries.size(), 2U);
  EXPECT_EQ(summaries[0].pops.pushes, 4);
  EXPECT_EQ(summaries[0].pops.least_force_n, 4);
  EXPECT_EQ(summaries[0].pops.popped_under[1], 1);
  EXPECT_EQ(summaries[0].error.error_n.count(), 2U);
  EXPECT_TRUE(summaries[1].setting.filtered);
}

TEST(AccuracySummary, NamesARowThatPopsThrough) {
  AccuracyRow row;
  row.setting.law = ForceLaw::surface;
  row.scene = "bowl";
  row.pops.pushes = 1;
  row.pops.least_force_n = 30;
  const auto popThrough = [&row] {
    const std::vector<Requirement> all = requirementsOf({row});
    return *std::ranges::find_if(all, [](const Requirement& requirement) {
      return requirement.law == "surface" && requirement.text.starts_with("pushes that pop through");
    });
  };
  EXPECT_TRUE(popThrough().met());
  row.pops.popped_under = {0, 0, 1};
  EXPECT_FALSE(popThrough().met());
  EXPECT_EQ(popThrough().violated, 1U);
  EXPECT_NE(popThrough().worst.find("bowl"), std::string::npos);
}

}  // namespace
}  // namespace hapticd::tools
