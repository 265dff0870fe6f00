// SPDX-License-Identifier: Apache-2.0
// True scenes against brute force, and judgements of synthetic series.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <variant>
#include <vector>

#include "tools/hapticbench/occlusion/occlusion.h"
#include "tools/lib/truth/any_camera.h"
#include "tools/lib/truth/occluded_scene.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kMiddle_m = 0.03;
constexpr double kRounding = 1e-12;

OccludedSceneParameters bodyOf(OccluderShape shape) {
  return {.occluder = shape, .width_m = 0.08, .thickness_m = 0.05, .back_m = 0.7};
}

bool isInBody(OccluderShape shape, const PlanPoint& p) {
  const double across = (p.x_m - kMiddle_m) / 0.04;
  const double along = (p.depth_m - 0.675) / 0.025;
  return shape == OccluderShape::box ? std::abs(across) <= 1 && std::abs(along) <= 1
                                     : across * across + along * along <= 1;
}

/// The first of many steps along a path that is in the body, as a share of the path; 2 for none.
double firstStepInBody(OccluderShape shape, const PlanPoint& from, const PlanPoint& to, int steps) {
  for (int i = 0; i <= steps; ++i) {
    const double share = static_cast<double>(i) / steps;
    const PlanPoint p{from.x_m + share * (to.x_m - from.x_m),
                      from.depth_m + share * (to.depth_m - from.depth_m)};
    if (isInBody(shape, p)) return share;
  }
  return 2;
}

class OccludedSceneBody : public testing::TestWithParam<OccluderShape> {};

TEST_P(OccludedSceneBody, IsMetWhereStepsAlongTheWayFirstFallIntoIt) {
  constexpr int kSteps = 20000;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> aside(-0.1, 0.15);
  int met = 0;
  for (int i = 0; i < 200; ++i) {
    const PlanPoint from{aside(random), 0};
    const PlanPoint to{aside(random), 1};
    const double stepped = firstStepInBody(GetParam(), from, to, kSteps);
    const double computed = meetsOccluder(bodyOf(GetParam()), kMiddle_m, from, to);
    // A path may touch the body between two steps; it is in it for less than a step then.
    const double along = computed <= 1 ? computed + 1.0 / kSteps : 2;
    const PlanPoint within{from.x_m + along * (to.x_m - from.x_m), along};
    if (stepped > 1 && computed <= 1 && !isInBody(GetParam(), within)) continue;
    ASSERT_EQ(stepped <= 1, computed <= 1) << from.x_m << " to " << to.x_m;
    if (stepped > 1) continue;
    ++met;
    EXPECT_NEAR(computed, stepped, 1.0 / kSteps + kRounding);
  }
  EXPECT_GT(met, 50);
}

INSTANTIATE_TEST_SUITE_P(Shapes, OccludedSceneBody,
                         testing::Values(OccluderShape::box, OccluderShape::elliptic_cylinder),
                         [](const auto& shape) {
                           return shape.param == OccluderShape::box ? "Box" : "Ellipse";
                         });

TEST(OccludedScene, ShowsTheBodyBeforeTheWallAndAShadowOnTheLeftOfIt) {
  OccludedSceneParameters parameters = bodyOf(OccluderShape::box);
  parameters.projector_shadow = true;
  const rt::DepthModelParameters camera;
  const OccludedScene scene(parameters, camera, SceneNoise::none, 1);
  const OccludedMoment moment{.wall_m = 1, .occluder_x_m = 0};
  const auto columnOf = [&camera](double x_m, double depth_m) {
    return static_cast<int>(std::lround(camera.cx_px + camera.fx_px * x_m / depth_m));
  };
  EXPECT_DOUBLE_EQ(scene.depth_m(columnOf(0, 0.65), moment), 0.65);
  EXPECT_DOUBLE_EQ(scene.depth_m(columnOf(0.3, 1), moment), 1);
  EXPECT_DOUBLE_EQ(scene.depth_m(columnOf(-0.3, 1), moment), 1);
  // The ray from the projector, 75 mm to the right, past the body's left front corner (-0.04, 0.65) meets the
  // wall at x = 0.075 - 0.115 / 0.65 = -0.1019; the camera's past that corner at -0.0615.
  EXPECT_EQ(scene.depth_m(columnOf(-0.08, 1), moment), 0);
  EXPECT_DOUBLE_EQ(scene.depth_m(columnOf(-0.106, 1), moment), 1);
}

TEST(OccludedScene, ShowsTheSideOfABlockThatFacesTheOpticalAxisAlone) {
  const rt::DepthModelParameters camera;
  OccludedSceneParameters parameters{.background_m = 1.5};
  parameters.left_m = 0.1;
  const OccludedScene visible(parameters, camera, SceneNoise::none, 1);
  // the ray with x = 0.08 per metre of depth meets the side x = 0.1 at 1.25 m
  const int column = static_cast<int>(std::lround(camera.cx_px + 0.08 * camera.fx_px));
  const double slope = (column - camera.cx_px) / camera.fx_px;
  EXPECT_NEAR(visible.depth_m(column, {.wall_m = 1}), 0.1 / slope, 1e-12);
  parameters.left_m = -1;
  parameters.right_m = 0.1;
  const OccludedScene hidden(parameters, camera, SceneNoise::none, 1);
  const int beside = static_cast<int>(std::lround(camera.cx_px + 0.11 * camera.fx_px));
  EXPECT_DOUBLE_EQ(hidden.depth_m(beside, {.wall_m = 1}), 1.5);
  EXPECT_DOUBLE_EQ(hidden.depth_m(column, {.wall_m = 1}), 1);
}

TEST(OccludedScene, IsSeenByACameraThatDeliversDepthWithItsNoise) {
  const rt::DepthModelParameters camera = timeOfFlightCamera(320, 288);
  const OccludedSceneParameters parameters = bodyOf(OccluderShape::box);
  const OccludedMoment moment{.wall_m = 1, .occluder_x_m = 0};
  for (const SceneNoise noise : {SceneNoise::quantised, SceneNoise::sensor, SceneNoise::harsh}) {
    OccludedScene scene(parameters, camera, noise, 1);
    const auto frame = std::make_unique<rt::DepthFrame>();
    scene.render(moment, 1, *frame);
    ASSERT_EQ(frame->camera, camera);
    double squares = 0;
    for (int row = 0; row < 288; ++row) {
      for (int column = 0; column < 320; ++column) {
        const std::uint16_t raw = frame->raw[row * rt::strideOf(320) + column];
        const double depth_m = scene.depth_m(column, moment);
        squares += std::pow((camera.unit_m * raw - depth_m) / camera.noise.sigma_m(depth_m), 2);
      }
    }
    // Depths of whole millimetres are not rounded; with noise rounding adds 0.29 mm to 1.5 mm or more. 92160
    // independent pixels have a standard error of 0.23 %.
    const double rms = std::sqrt(squares / (320 * 288));
    const double expected = noise == SceneNoise::quantised ? 0 : noise == SceneNoise::sensor ? 1 : 2;
    EXPECT_GE(rms, 0.99 * expected) << nameOf(noise);
    EXPECT_LE(rms, expected == 0 ? 1e-9 : 1.01 * std::hypot(expected, 0.19)) << nameOf(noise);
  }
}

constexpr Vec3 kThree_n{0, 0, 3};

TEST(JudgePassage, FindsNothingWrongWithAnIdealLaw) {
  const std::vector<PassageTick> pressing(100, {kThree_n, kThree_n});
  const PassageResult result = judgePassage(pressing, pressing);
  EXPECT_EQ(result.pressed, 100U);
  EXPECT_EQ(result.lost, 0U);
  EXPECT_EQ(result.error.above, 0U);
  EXPECT_EQ(result.change.above, 0U);
  EXPECT_EQ(result.ghost.ticks, 0U);
}

TEST(JudgePassage, CountsGhostForcesOnAFreeHand) {
  std::vector<PassageTick> during(200);
  for (std::size_t i = 50; i < 90; ++i) during[i].force_n = {0, 0, 0.25};
  const PassageResult result = judgePassage(std::vector<PassageTick>(10), during);
  EXPECT_DOUBLE_EQ(result.ghost.percent(), 20);
  EXPECT_EQ(result.ghost.longest, 40U);
  EXPECT_DOUBLE_EQ(result.ghost.largest, 0.25);
}

TEST(JudgePassage, DistinguishesALostContactFromOneThatIsWrongAllAlong) {
  const std::vector<PassageTick> before(10, {{0, 0, 2}, kThree_n});  // 1 N too weak already
  std::vector<PassageTick> during(100, {{0, 0, 2}, kThree_n});
  for (std::size_t i = 0; i < 30; ++i) during[i].force_n = {};
  const PassageResult result = judgePassage(before, during);
  EXPECT_EQ(result.lost, 30U);
  EXPECT_EQ(result.error.longest, 100U);
  EXPECT_EQ(result.change.longest, 30U);
}

constexpr double kStiffness_n_per_m = 500;

/// A HIP that came 4 mm deep through a side whose normal is x, 20 mm behind a front whose normal is z.
EntryTick insideTick(const Vec3& force_n, rt::ContactState state) {
  return {.force_n = force_n,
          .state = state,
          .inside = true,
          .has_side = true,
          .true_n = {2, 0, 0},
          .front_n = {0, 0, 10}};
}

EntryResult judged(const std::vector<EntryTick>& ticks) {
  return judgeEntry(ticks, kStiffness_n_per_m);
}

TEST(JudgeEntry, AcceptsTheForceOfTheSideThatWasTouchedOrNoneThatIsReported) {
  const EntryResult result =
      judged({insideTick({2, 0, 0}, rt::ContactState::contact), insideTick({}, rt::ContactState::behind),
              insideTick({}, rt::ContactState::free), insideTick({-4, 0, 0}, rt::ContactState::contact)});
  EXPECT_EQ(result.inside, 4U);
  EXPECT_EQ(result.of_body, 1U);
  EXPECT_EQ(result.none_reported, 1U);
  EXPECT_EQ(result.none_silent, 1U);
  EXPECT_EQ(result.wrong, 1U);
  EXPECT_EQ(result.sideways_n, 0);  // there is a side to come through
  EXPECT_DOUBLE_EQ(result.early_n, 4);
  EXPECT_NEAR(result.angle_deg, 180, 1e-9);
}

TEST(JudgeEntry, RefusesTheSpringOfTheFrontAtASide) {
  for (const double size_n : {2.0, 10.0}) {
    const EntryResult result = judged({insideTick({0, 0, size_n}, rt::ContactState::contact)});
    EXPECT_EQ(result.wrong, 1U) << size_n;
    EXPECT_NEAR(result.angle_deg, 90, 1e-9);
  }
}

TEST(JudgeEntry, AcceptsSideAndFrontWhereTheFrontIsNearer) {
  EntryTick of_front = insideTick({0, 0, 10}, rt::ContactState::contact);
  of_front.true_n = {12, 0, 0};
  EntryTick of_side = of_front;
  of_side.force_n = {12, 0, 0};
  EntryTick between = of_front;
  between.force_n = {6, 0, 5};
  EntryTick beyond = of_front;
  beyond.force_n = {-8, 0, 8};
  const EntryResult result = judged({of_front, of_side, between, beyond});
  EXPECT_EQ(result.of_body, 3U) << "between the two the force turns over";
  EXPECT_EQ(result.wrong, 1U);
  EXPECT_NEAR(result.angle_deg, 45, 1e-9);
}

TEST(JudgeEntry, LetsAForceTurnOverOnlyForAsLongAsTheBlendTakes) {
  EntryTick between = insideTick({6, 0, 5}, rt::ContactState::contact);
  between.true_n = {12, 0, 0};
  between.front_n = {0, 0, 10};
  // 15.6 N at 0.25 N per tick
  const EntryResult result = judged(std::vector<EntryTick>(100, between));
  EXPECT_EQ(result.of_body, 63U);
  EXPECT_EQ(result.wrong, 37U);
}

TEST(JudgeEntry, LeavesOutOfAStepWhatTheMotionOfTheHipExplains) {
  EntryTick first;
  first.blended_n = {1, 0, 0};
  EntryTick second;
  second.blended_n = {1.5, 0, 0};
  second.hip_m = {-0.0005, 0, 0};  // 0.25 N
  EXPECT_NEAR(judged({first, second}).step_n, 0.25, 1e-12);
}

TEST(JudgeEntry, LooksForTheLargestEarlyForceFor20Milliseconds) {
  std::vector<EntryTick> ticks(5);  // outside
  for (int i = 0; i < 40; ++i) ticks.push_back(insideTick({2, 0, 0}, rt::ContactState::contact));
  ticks[5 + 19].force_n.x = 3;
  ticks[5 + 20].force_n.x = 7;
  EXPECT_DOUBLE_EQ(judged(ticks).early_n, 3);
}

TEST(JudgeEntry, FindsASidewaysWallWhereThereIsNoSide) {
  EntryTick tick = insideTick({4, 0, 1}, rt::ContactState::contact);
  tick.has_side = false;
  tick.true_n = {0, 0, 10};
  const EntryResult result = judged({tick});
  EXPECT_DOUBLE_EQ(result.sideways_n, 4);
  EXPECT_EQ(result.wrong, 1U);
}

TEST(BlockWithSide, FacesTheCameraWithTheSideOnTheSideThatItIsSaid) {
  for (const BlockSide side : kAllOf<BlockSide>) {
    for (const double side_m : {-0.1, 0.1}) {
      const TrueBody block = blockWithSide(side, side_m, 1);
      const auto distance_m = [&block](const Vec3& p) {
        return std::visit([&p](const auto& body) { return body.signedDistance(p); }, block);
      };
      const Vec3 on_side = side_m * outOf(side) + Vec3{0, 0, -1.02};
      EXPECT_NEAR(distance_m(on_side - 0.01 * outOf(side)), -0.01, kRounding) << nameOf(side);
      EXPECT_NEAR(distance_m(on_side + 0.01 * outOf(side)), 0.01, kRounding) << nameOf(side);
      const Vec3 on_front = (side_m - 0.05) * outOf(side) + Vec3{0, 0, -1};
      EXPECT_NEAR(distance_m(on_front + Vec3{0, 0, 0.01}), 0.01, kRounding) << nameOf(side);
    }
  }
}

/// 4 N that fall to nothing within that many ticks, in equal steps.
std::vector<double> falling(int ticks) {
  std::vector<double> force_n(400, 4);
  for (int i = 1; i <= ticks; ++i) force_n.push_back(4 - 4.0 * i / ticks);
  force_n.insert(force_n.end(), 100, 0);
  return force_n;
}

TEST(JudgeOutline, MeasuresInHowManyFramesAForceFalls) {
  const OutlineResult result = judgeOutline(falling(125), 4);  // 100 ms from 90 to 10 %
  EXPECT_EQ(result.not_pressed, 0);
  EXPECT_EQ(result.held, 0);
  EXPECT_NEAR(result.fewest_frames, 3, 0.03);  // one tick
  EXPECT_NEAR(result.drop_n, 0.032, 1e-12);
}

TEST(JudgeOutline, FindsAForceThatVanishesInOneTick) {
  const OutlineResult result = judgeOutline(falling(1), 4);
  EXPECT_DOUBLE_EQ(result.drop_n, 4);
  EXPECT_NEAR(result.fewest_frames, 0.03, 1e-9);
}

TEST(JudgeOutline, FindsADropAtTheEndOfARiseAndOneThatComesBack) {
  std::vector<double> force_n;
  for (int i = 0; i < 200; ++i) force_n.push_back(4 + 0.05 * i);
  force_n.insert(force_n.end(), 30, 0);
  force_n.insert(force_n.end(), 400, 14);
  const OutlineResult result = judgeOutline(force_n, 4);
  EXPECT_NEAR(result.drop_n, 13.95, 1e-9);
  EXPECT_LT(result.fewest_frames, 1);
}

TEST(JudgeOutline, TakesTheSpeedOfAFallThatStopsOnTheWay) {
  std::vector<double> force_n(400, 10);
  for (int i = 1; i <= 100; ++i) force_n.push_back(10 - 0.06 * i);  // to 4 N, 90 to 10 % in 133 ms
  force_n.insert(force_n.end(), 500, 4);
  EXPECT_NEAR(judgeOutline(force_n, 4).fewest_frames, 4, 0.12);  // a tick at either end, twice
  force_n.assign(400, 10);
  force_n.insert(force_n.end(), 500, 4);
  EXPECT_NEAR(judgeOutline(force_n, 4).fewest_frames, 0.06, 1e-9);
  force_n.assign(400, 10);
  force_n.insert(force_n.end(), 500, 6);  // what is no half is no fall
  EXPECT_TRUE(std::isinf(judgeOutline(force_n, 4).fewest_frames));
}

TEST(JudgeOutline, TellsAForceThatIsHeldFromOneThatWasNever) {
  EXPECT_EQ(judgeOutline(std::vector<double>(500, 4), 4).held, 1);
  EXPECT_TRUE(std::isinf(judgeOutline(std::vector<double>(500, 4), 4).fewest_frames));
  EXPECT_EQ(judgeOutline(std::vector<double>(500, 0), 4).not_pressed, 1);
}

TEST(JudgeNearLimit, MeasuresHowLongTheForceIsHeldAndWhenItIsReleased) {
  std::vector<NearLimitTick> ticks(100, {3, rt::Cause::none});
  for (int i = 0; i < 500; ++i) ticks.push_back({3, rt::Cause::none});
  for (int i = 1; i <= 200; ++i) ticks.push_back({3 - 0.015 * i, rt::Cause::surface_too_near});
  ticks.insert(ticks.end(), 300, {0, rt::Cause::surface_too_near});
  const std::size_t back = ticks.size();
  ticks.insert(ticks.end(), 50, {2.9, rt::Cause::none});
  const NearLimitResult result = judgeNearLimit(ticks, 100, back);
  EXPECT_DOUBLE_EQ(result.force_n, 3);
  EXPECT_NEAR(result.held_ms, 600, 1);  // 500 and half of the ramp of 200
  EXPECT_NEAR(result.least_held_n, 1.5, 0.015);
  EXPECT_NEAR(result.released_ms, 690, 1);  // 500 and 95 % of it
  EXPECT_NEAR(result.largest_step_n, 0.015, 1e-9);
  EXPECT_TRUE(result.cause_named);
  EXPECT_TRUE(result.came_back);
}

TEST(JudgeNearLimit, SeesAForceThatVanishesAtOnce) {
  std::vector<NearLimitTick> ticks(100, {4, rt::Cause::none});
  ticks.insert(ticks.end(), 400, {0, rt::Cause::none});
  const NearLimitResult result = judgeNearLimit(ticks, 100, 450);
  EXPECT_EQ(result.held_ms, 0);
  EXPECT_EQ(result.released_ms, 0);
  EXPECT_DOUBLE_EQ(result.largest_step_n, 4);
  EXPECT_FALSE(result.cause_named);
  EXPECT_FALSE(result.came_back);
}

TEST(Passage, BringsTheBodyBeforeTheHandWhenItHasArrived) {
  const PassageCase at_one_metre{.wall_m = 1, .gap_m = 0.1};
  const Passage passage(at_one_metre);
  // 1.2 s of rest, 0.25 m at 0.3 m/s to the line of sight, as much away from it, half a second of rest
  const long arrival = 1200 + std::lround(0.25 / 0.3 * 1000);
  EXPECT_EQ(passage.end(), 1200 + 2 * std::lround(0.25 / 0.3 * 1000) + 500);
  const Vec3 hip = passage.hip_m(arrival);
  EXPECT_DOUBLE_EQ(hip.z, -0.97);
  // the body's middle is 100 + 40 mm before the HIP, on its line of sight
  EXPECT_NEAR(passage.bodyX_m(arrival), hip.x * (0.97 - 0.14) / 0.97, 1e-12);
  EXPECT_NEAR(passage.bodyX_m(arrival + 100) - passage.bodyX_m(arrival), 0.03, 1e-12);
  EXPECT_DOUBLE_EQ(passage.bodyX_m(0), passage.bodyX_m(1200));
}

}  // namespace
}  // namespace hapticd::tools
