// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tools/hapticbench/engine/laws.h"
#include "tools/hapticbench/godobject/godobject.h"
#include "tools/lib/truth/noise_floor.h"

/// The law `surface` against a god-object on the signed distance of the scene that the camera sees at 1 m.
namespace hapticd {
namespace {

using tools::GodObjectFigures;
using tools::SceneNoise;

GodObjectFigures figuresOf(const std::string& name, SceneNoise noise) {
  constexpr double kDistance_m = 1;
  const auto scene = std::ranges::find(tools::godObjectScenes(), name, &tools::GodObjectScene::name);
  const std::vector<rt::LiveParameters> settings{tools::shippedParameters("surface", kDistance_m)};
  return tools::measureScene(*scene, {.distance_m = kDistance_m, .noise = noise}, settings).front();
}

double jndOf(const tools::Spread& error_n) {
  return error_n.rms() / tools::kForceJnd_n;
}

TEST(GodObject, IsFollowedWhereFacesMeet) {
  for (const char* name : {"vee60", "vee90", "vee120", "hollowcorner", "bowl"}) {
    SCOPED_TRACE(name);
    const GodObjectFigures exact = figuresOf(name, SceneNoise::none);
    EXPECT_EQ(exact.lost_ticks, 0);
    EXPECT_EQ(exact.aside_ticks, 0);
    EXPECT_LT(jndOf(exact.error_n), 0.1);
    const GodObjectFigures noisy = figuresOf(name, SceneNoise::sensor);
    EXPECT_EQ(noisy.lost_ticks, 0);
    // what noise leaves of planes of this size
    EXPECT_LT(jndOf(noisy.error_n), 1);
  }
}

TEST(GodObject, IsFollowedAlongSides) {
  for (const char* name : {"plateside", "plateside3"}) {
    for (const SceneNoise noise : {SceneNoise::none, SceneNoise::sensor}) {
      SCOPED_TRACE(testing::Message() << name << ", noise " << nameOf(noise));
      const GodObjectFigures figures = figuresOf(name, noise);
      EXPECT_EQ(figures.aside_ticks, 0);
      // The outline is known to a pixel, 1.7 mm.
      EXPECT_LT(jndOf(figures.error_n), 0.85 / tools::kForceJnd_n);
      EXPECT_LE(figures.step_n, 0.5) << "no more than the fastest surface, as a place and as a pull";
    }
  }
}

TEST(GodObject, IsFollowedOverLimbsAndThroughValleys) {
  const GodObjectFigures balls = figuresOf("twoballs", SceneNoise::none);
  EXPECT_EQ(balls.lost_ticks, 0);
  EXPECT_LT(jndOf(balls.error_n), 1);
  EXPECT_LE(balls.step_n, 0.5);
  const GodObjectFigures sunk = figuresOf("halfsunk", SceneNoise::none);
  EXPECT_EQ(sunk.lost_ticks, 0);
  // where the ball is so steep that its last pixels show it and the table
  EXPECT_LT(jndOf(sunk.error_n), 3);
}

TEST(GodObject, IsFollowedOverAGapInTheMeasurements) {
  for (const SceneNoise noise : {SceneNoise::none, SceneNoise::sensor, SceneNoise::harsh}) {
    SCOPED_TRACE(nameOf(noise));
    const GodObjectFigures figures = figuresOf("band", noise);
    EXPECT_EQ(figures.lost_ticks, 0);
    EXPECT_EQ(figures.aside_ticks, 0);
    // over the gap the surface is a plane through two places of a noisy one
    EXPECT_LT(jndOf(figures.error_n), 1.5);
  }
}

TEST(GodObject, LeavesAFreeHandAlone) {
  for (const SceneNoise noise : {SceneNoise::none, SceneNoise::sensor, SceneNoise::harsh}) {
    SCOPED_TRACE(nameOf(noise));
    EXPECT_LE(figuresOf("freehand", noise).ghost_n, 0.1);
  }
}

}  // namespace
}  // namespace hapticd
