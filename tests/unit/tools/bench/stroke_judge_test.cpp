// SPDX-License-Identifier: Apache-2.0
// Judgements of synthetic laws by the stroke bench: an ideal one, and each kind of a bad one.

#include "tools/hapticbench/strokes/strokes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kStiffness_n_per_m = 500;
constexpr double kTick_m = 0.0001;  // of a stroke at 0.1 m/s
constexpr JudgeLimits kLimits{.lag_m = 0.005, .end_m = 0, .pitch_m = 0.001, .clear_m = 0.002};

/// A stroke of 100 mm, 8 mm below the plane z = 0, that leaves the body at 80 mm.
std::vector<TrueTick> madeUpStroke() {
  constexpr double kEnd_m = 0.08 - kTick_m / 2;  // between two ticks
  std::vector<TrueTick> ticks;
  for (int i = 0; i < 1000; ++i) {
    const double place = i * kTick_m;
    TrueTick tick;
    tick.hip_m = {place, 0, -0.008};
    tick.along = {1, 0, 0};
    tick.past_end_m = place - kEnd_m;
    tick.judged = true;
    if (place < kEnd_m) {
      tick.hold = Hold{{place, 0, 0}, {0, 0, 1}};
      tick.force_n = kStiffness_n_per_m * (tick.hold->proxy_m - tick.hip_m);
    } else {
      tick.clearance_m = place - kEnd_m;
    }
    ticks.push_back(tick);
  }
  return ticks;
}

LawTick ideal(const TrueTick& truth) {
  if (!truth.hold) return {{}, {}, truth.hip_m, rt::ContactState::free, false};
  return {truth.force_n, truth.force_n, truth.hold->proxy_m, rt::ContactState::contact, false};
}

StrokeFigures judged(const std::function<LawTick(const TrueTick&)>& law) {
  const std::vector<TrueTick> truth = madeUpStroke();
  std::vector<LawTick> output;
  for (const TrueTick& tick : truth) output.push_back(law(tick));
  return judgeStroke(truth, output, kLimits);
}

TEST(StrokeJudge, FindsNothingWrongWithAnIdealLaw) {
  const StrokeFigures figures = judged(ideal);
  EXPECT_EQ(figures.contact_ticks, 800);
  EXPECT_EQ(figures.error.error_n.max(), 0);
  EXPECT_EQ(figures.along_n.max(), 0);
  EXPECT_EQ(figures.lost_ticks, 0);
  EXPECT_EQ(figures.lagged, 0);
  EXPECT_EQ(figures.stopped, 0);
  EXPECT_EQ(figures.ghost_ticks, 0);
  EXPECT_EQ(figures.end.ends, 1);
  EXPECT_NEAR(figures.end.latest_m, 0, 1.001 * kTick_m);
}

TEST(StrokeJudge, FindsAProxyThatStops) {
  static constexpr double kStuck_m = 0.03;
  const StrokeFigures figures = judged([](const TrueTick& truth) {
    LawTick output = ideal(truth);
    output.proxy_m.x = std::min(output.proxy_m.x, kStuck_m);
    output.state = rt::ContactState::contact;
    output.law_force_n = kStiffness_n_per_m * (output.proxy_m - truth.hip_m);
    return output;
  });
  EXPECT_EQ(figures.stopped, 1);
  EXPECT_EQ(figures.lagged, 1);
  EXPECT_NEAR(figures.lag_m, 0.05, 2 * kTick_m);  // the body ends 50 mm after where the proxy stopped
  EXPECT_NEAR(figures.along_n.max(), kStiffness_n_per_m * 0.05, kStiffness_n_per_m * 2 * kTick_m);
  EXPECT_GT(figures.ghost_ticks, 0);
}

TEST(StrokeJudge, DistinguishesAProxyThatCatchesUpFromOneThatStops) {
  const StrokeFigures figures = judged([](const TrueTick& truth) {
    LawTick output = ideal(truth);
    const double place = truth.hip_m.x;
    if (place > 0.02 && place < 0.03) output.proxy_m.x = 0.02;
    return output;
  });
  EXPECT_EQ(figures.lagged, 1);
  EXPECT_EQ(figures.stopped, 0);
  EXPECT_NEAR(figures.lag_m, 0.01, 2 * kTick_m);
}

TEST(StrokeJudge, CountsTheTicksWithoutForceAndThoseWithForceIntoTheBody) {
  const StrokeFigures figures = judged([](const TrueTick& truth) {
    LawTick output = ideal(truth);
    const double place = truth.hip_m.x;
    if (place > 0.01 - kTick_m / 2 && place < 0.02 - kTick_m / 2) output.law_force_n = {};
    if (place > 0.04 - kTick_m / 2 && place < 0.06 - kTick_m / 2) output.law_force_n = {0, 0, -1};
    return output;
  });
  EXPECT_EQ(figures.lost_ticks, 100);
  EXPECT_EQ(figures.wrong_side_ticks, 200);
}

TEST(StrokeJudge, CountsTheTicksWithTheForceOfTheSurfaceAndComparesTheSizes) {
  const StrokeFigures figures = judged([](const TrueTick& truth) {
    LawTick output = ideal(truth);
    const double place = truth.hip_m.x;
    if (place < 0.02 - kTick_m / 2) output.law_force_n = {0, 0, 5};  // too large
    if (place > 0.03 - kTick_m / 2 && place < 0.04 - kTick_m / 2) output.law_force_n = {4, 0, 0};  // aside
    return output;
  });
  EXPECT_EQ(figures.right_ticks, 800 - 200 - 100);
  EXPECT_NEAR(figures.sizeRatio().value(), (600 * 4 + 200 * 5) / (800.0 * 4), 1e-9);
  EXPECT_EQ(judged(ideal).rightPercent(), 100);
}

TEST(DelaySearch, FindsByHowMuchAForceComesLater) {
  constexpr int kTicks = 1000;
  // Two whole periods in the ticks that every shift has: a constant error then prefers none.
  constexpr double kPeriod_ticks = (kTicks - DelaySearch::kLatest_ms + DelaySearch::kEarliest_ms) / 2.0;
  const auto sine = [](int tick) {
    return Vec3{0, 0, 4 + 3 * std::sin(2 * std::numbers::pi * tick / kPeriod_ticks)};
  };
  std::vector<Vec3> true_n;
  for (int i = 0; i < kTicks; ++i) true_n.push_back(sine(i));
  for (const int late_ms : {-17, 0, 1, 42}) {
    std::vector<Vec3> force_n;
    for (int i = 0; i < kTicks; ++i) force_n.push_back(sine(i - late_ms) + Vec3{0, 0, 0.1});
    DelaySearch search;
    search.add(force_n, true_n);
    EXPECT_EQ(search.delay_ms(), late_ms);
  }
  EXPECT_FALSE(DelaySearch().delay_ms().has_value());
}

TEST(StrokesRow, KnowsItsErrorByTheSpreadOverTheSeeds) {
  StrokesRow row;
  EXPECT_FALSE(row.standardError_n());
  for (const double rms_n : {0.8, 1.0, 1.2}) row.error_of_seed_n.emplace_back().add(rms_n);
  EXPECT_NEAR(row.standardError_n().value(), 0.2 / std::sqrt(3.0), 1e-12);
}

TEST(StrokeCases, AHipInAnOrgansWayIsAlwaysInContact) {
  std::mt19937 random(7);
  for (const StrokeScene& scene : strokeScenes()) {
    const bool is_organ = scene.name.ends_with("_plane") || scene.name.ends_with("_ball");
    if (!is_organ) continue;
    for (const StrokeCase& stroke : strokeCases(scene, {}, random)) {
      BodyScene bodies(stroke.bodies, stroke.T_camera_bodies, stroke.motion, {}, 1);
      const double stays_from_s = kSteady_s + stroke.phase_s;
      const Vec3 hip = bodies.frameAt(stays_from_s).positionOut(stroke.path.hip_m(0));
      for (double t_s = stays_from_s; t_s < stays_from_s + stroke.stays_s; t_s += 0.01)
        EXPECT_LT(bodies.signedDistance(hip, t_s), -0.003) << scene.name << t_s;
    }
  }
}

TEST(StrokeJudge, CountsForceOnlyWhereTheHipIsClearOfEverything) {
  const StrokeFigures figures = judged([](const TrueTick& truth) {
    LawTick output = ideal(truth);
    if (!truth.hold && truth.clearance_m < 0.005) output.law_force_n = {0, 0, 3};
    return output;
  });
  EXPECT_NEAR(static_cast<double>(figures.ghost_ticks), 30, 1);  // from 2 to 5 mm beside the body
  EXPECT_EQ(figures.ghost_n, 3);
  EXPECT_NEAR(figures.end.latest_m, 0.005, 1.001 * kTick_m);
  EXPECT_NEAR(figures.end.worst_pitches, 5, 0.11);
}

TEST(StrokeJudge, SaysHowFarBeforeTheEndContactWasLost) {
  const StrokeFigures figures = judged([](const TrueTick& truth) {
    LawTick output = ideal(truth);
    if (truth.past_end_m > -0.012) output.law_force_n = {};
    return output;
  });
  EXPECT_NEAR(figures.end.earliest_m, -0.012, 1.001 * kTick_m);
}

TEST(StrokeCases, EveryHipComesFromFreeSpaceAndIsThenAsDeepAsSaid) {
  std::mt19937 random(3);
  for (const StrokeScene& scene : strokeScenes()) {
    if (scene.moving || scene.name.ends_with("_deep")) continue;
    for (const StrokeCase& stroke : strokeCases(scene, {.distance_m = 0.6, .depth_m = 0.004}, random)) {
      BodyScene bodies(stroke.bodies, stroke.T_camera_bodies, {}, {}, 1);
      IdealConstraint truth(bodies);
      const auto at = [&](const Vec3& p) { return stroke.T_camera_bodies.positionOut(p); };
      EXPECT_FALSE(truth.follow(at(stroke.path.approach_m(0.02)), 0)) << scene.name;
      for (const double share : {0.0, 0.3, 0.6, 1.0}) {
        const double stroked_m = share * stroke.path.length_m;
        const auto held = truth.follow(at(stroke.path.hip_m(stroked_m)), 0);
        const bool over = stroke.ends_at_m && !stroke.ends_unseen && stroked_m >= *stroke.ends_at_m;
        ASSERT_EQ(held.has_value(), !over) << scene.name << share;
        if (over || scene.name == "cube_corner" || scene.name.starts_with("inner")) continue;
        EXPECT_NEAR(norm(held->proxy_m - at(stroke.path.hip_m(stroked_m))), stroke.path.depth_m, 1e-9)
            << scene.name;
      }
    }
  }
}

TEST(StrokeCases, TheCameraSeesTheSurfaceThatIsStroked) {
  std::mt19937 random(5);
  const rt::DepthModelParameters camera;
  for (const StrokeScene& scene : strokeScenes()) {
    if (scene.moving) continue;
    for (const StrokeCase& stroke : strokeCases(scene, {.distance_m = 0.8, .depth_m = 0.004}, random)) {
      BodyScene bodies(stroke.bodies, stroke.T_camera_bodies, {}, {}, 1);
      IdealConstraint truth(bodies);
      const auto at = [&](const Vec3& p) { return stroke.T_camera_bodies.positionOut(p); };
      truth.follow(at(stroke.path.approach_m(0.02)), 0);
      const double last_m = std::min(stroke.path.length_m, stroke.ends_at_m.value_or(1) - 0.001);
      for (const double share : {0.0, 0.5, 1.0}) {
        const auto held = truth.follow(at(stroke.path.hip_m(share * last_m)), 0);
        ASSERT_TRUE(held) << scene.name;
        const Vec3& p = held->proxy_m;
        const double column = camera.cx_px + camera.fx_px * p.x / -p.z;
        const double row = camera.cy_px - camera.fy_px * p.y / -p.z;
        EXPECT_NEAR(bodies.trueDepth(column, row, 0), -p.z, 1e-9) << scene.name << share;
      }
    }
  }
}

StrokesRow rowOf(const char* law, int lagged) {
  StrokesRow row;
  row.law = law;
  row.scene = strokeScenes().front();
  row.distance_m = 1;
  row.figures.strokes = 10;
  row.figures.lagged = lagged;
  return row;
}

TEST(StrokesRequirements, CountTheRowsThatBreakABoundForEachLaw) {
  const auto requirements =
      requirementsOf(std::vector{rowOf("surface", 0), rowOf("surface", 2), rowOf("proxy", 0)});
  const auto of = [&requirements](const char* law) {
    return *std::ranges::find_if(requirements, [law](const Requirement& one) {
      return one.law == law && one.text.find("stop or lag") != std::string::npos;
    });
  };
  EXPECT_EQ(of("surface").cases, 2U);
  EXPECT_EQ(of("surface").violated, 1U);
  EXPECT_EQ(of("proxy").cases, 1U);
  EXPECT_EQ(of("proxy").violated, 0U);
}

}  // namespace
}  // namespace hapticd::tools
