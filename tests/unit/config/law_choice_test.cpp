// SPDX-License-Identifier: Apache-2.0
#include "config/law_choice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace hapticd::config {
namespace {

constexpr double kStiffness = 500;

std::set<double> classes() {
  std::set<double> all;
  for (const MeasuredLaw& measured : measuredLaws()) all.insert(measured.distance_m);
  return all;
}

TEST(MeasuredLaws, KnowEachLawAtEachDistance) {
  for (const double class_m : classes()) {
    std::set<rt::ForceLaw> laws;
    for (const MeasuredLaw& measured : measuredLaws()) {
      if (measured.distance_m == class_m) laws.insert(measured.law);
      EXPECT_GT(measured.error_m, 0);
      EXPECT_GT(measured.cpu_ms_per_s, 0);
    }
    EXPECT_EQ(laws.size(), 4U) << class_m;
  }
  EXPECT_EQ(classes(), (std::set<double>{0.6, 0.8, 1, 1.5, 2, 3, 3.5}));
}

TEST(ChooseLaw, ChoosesTheCheapestWithinTheError) {
  for (const double class_m : classes()) {
    for (const double max_error_n : {0.05, 0.28, 1.0, 10.0, 100.0}) {
      const LawDecision decision = chooseLaw(max_error_n, kStiffness, class_m);
      double cheapest = 1e9;
      double cost = 1e9;
      for (const MeasuredLaw& measured : measuredLaws()) {
        if (measured.distance_m != class_m) continue;
        if (kStiffness * measured.error_m <= max_error_n)
          cheapest = std::min(cheapest, measured.cpu_ms_per_s);
        if (measured.law == decision.law && measured.filtered == decision.filtered)
          cost = measured.cpu_ms_per_s;
      }
      if (!decision.within) continue;
      EXPECT_LE(decision.error_n, max_error_n);
      EXPECT_EQ(cost, cheapest) << class_m << " " << max_error_n;
    }
  }
}

TEST(ChooseLaw, ChoosesAndNamesTheMostAccurateWhereNoneIsWithinTheError) {
  const LawDecision decision = chooseLaw(1e-6, kStiffness, 3.5);
  EXPECT_FALSE(decision.within);
  for (const MeasuredLaw& measured : measuredLaws()) {
    if (measured.distance_m != 3.5) continue;
    EXPECT_GE(kStiffness * measured.error_m, decision.error_n);
  }
  EXPECT_NE(decision.reason.find("none of"), std::string::npos) << decision.reason;
}

TEST(MeasuredLaws, FilterOnlyLawsOnPoints) {
  for (const MeasuredLaw& measured : measuredLaws()) {
    if (measured.law == rt::ForceLaw::surface) {
      EXPECT_FALSE(measured.filtered) << measured.distance_m;
    }
  }
}

// 20 %: one setting may be this much worse than the best at any distance, so that little is left to choose.
TEST(MeasuredLaws, HaveInSurfaceOneSettingThatIsNearlyTheMostAccurateEverywhere) {
  for (const double class_m : classes()) {
    double least_m = 1e9;
    double surface_m = 1e9;
    for (const MeasuredLaw& measured : measuredLaws()) {
      if (measured.distance_m != class_m) continue;
      least_m = std::min(least_m, measured.error_m);
      if (measured.law == rt::ForceLaw::surface) surface_m = measured.error_m;
    }
    EXPECT_LE(surface_m, 1.2 * least_m) << class_m;
  }
}

TEST(ChooseLaw, ScalesTheErrorWithTheStiffness) {
  EXPECT_DOUBLE_EQ(chooseLaw(1e-6, 1000, 1).error_n, 2 * chooseLaw(1e-6, 500, 1).error_n);
}

TEST(DistanceClass, IsTheNearestInRatioAndKeptALittleBeyondItsBorder) {
  EXPECT_EQ(distanceClass_m(0.1, 0), 0.6);
  EXPECT_EQ(distanceClass_m(1.1, 0), 1);
  EXPECT_EQ(distanceClass_m(10, 0), 3.5);
  const double border = std::sqrt(1.0 * 1.5);
  EXPECT_EQ(distanceClass_m(border * 1.04, 1), 1);
  EXPECT_EQ(distanceClass_m(border * 1.06, 1), 1.5);
  EXPECT_EQ(distanceClass_m(border / 1.04, 1.5), 1.5);
  EXPECT_EQ(distanceClass_m(border / 1.06, 1.5), 1);
}

TEST(EffectiveMaxError, IsSevenPercentOfTheForceLimitUnlessOneIsSet) {
  rt::SafetyParameters safety;
  safety.max_force_n = 4;
  EXPECT_DOUBLE_EQ(ForceSettings{}.effectiveMaxError_n(safety), 0.28);
  EXPECT_DOUBLE_EQ((ForceSettings{.max_error_n = 0.5}.effectiveMaxError_n(safety)), 0.5);
}

TEST(LiveWith, TakesLawAndFilterAndLeavesTheRest) {
  Settings settings;
  settings.live.springs.stiffness_n_per_m = 321;
  settings.live.filter.hold_frames = 9;
  settings.live.surface.fusion_frames = 5;
  settings.handle.device_mass_kg = 0.2;
  const rt::LiveParameters live =
      liveWith(settings, {.law = rt::ForceLaw::proxy, .filtered = true, .reason = {}});
  EXPECT_EQ(live.law, rt::ForceLaw::proxy);
  EXPECT_EQ(live.filter, filterOfChoice());
  EXPECT_EQ(live.springs.stiffness_n_per_m, 321);
  EXPECT_EQ(live.surface.fusion_frames, 5);
  EXPECT_EQ(live.handle.device_mass_kg, 0.2) << "the stiffness limit depends on it";
  EXPECT_TRUE(liveWith(settings, {.law = rt::ForceLaw::surface, .reason = {}}).filter.isOff());
}

TEST(EquivalentDistance, IsWhereAKinectHasTheSameNoise) {
  EXPECT_EQ(equivalentDistance_m({}, 1.3), 1.3);
  rt::DepthModelParameters stereo;
  stereo.law = rt::DepthLawKind::linear;
  EXPECT_EQ(equivalentDistance_m(stereo, 0.5), 0.5) << "its noise is not known";
  stereo.noise.c2_per_m = 4 * 0.54 * 0.003071102;  // twice as noisy as a Kinect at twice the distance
  EXPECT_NEAR(equivalentDistance_m(stereo, 0.5), 1.0, 1e-9);
  stereo.noise = {.c0_m = 0.54 * 0.003071102};  // the same everywhere, as a Kinect's at 1 m
  EXPECT_NEAR(equivalentDistance_m(stereo, 0.2), 1.0, 1e-9);
  EXPECT_NEAR(equivalentDistance_m(stereo, 3), 1.0, 1e-9);
}

}  // namespace
}  // namespace hapticd::config
