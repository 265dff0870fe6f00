// SPDX-License-Identifier: Apache-2.0
// The signed distances, what the camera sees of them, and the god-object, against closed forms and finite
// differences; the judgement of `hapticbench godobject` with made-up laws.

#include "tools/lib/truth/distance_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "tools/hapticbench/godobject/godobject.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

constexpr double kTick_m = 1e-4;  // of a hand at 0.1 m/s

class RandomPlaces {
 public:
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  Vec3 inCube(double half_m) {
    const double x = between(-half_m, half_m);
    const double y = between(-half_m, half_m);
    return {x, y, between(-half_m, half_m)};
  }

 private:
  std::mt19937 random_{11};
};

DistanceScene sceneOf(std::vector<DistanceBody> bodies) {
  return {std::move(bodies), {}, {}, 1};
}
/// A wall below z = 0 and one below x = 0: their inner edge is the y axis.
std::vector<DistanceBody> innerEdge() {
  return {{PlaneShape{}, {}}, {PlaneShape{}, {{}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0}}}};
}

TEST(DistanceShape, HasADistanceThatGrowsAsItsGradientSaysAndLeadsToTheSurface) {
  const RigidFrame frame = RigidFrame{}.moved({0.3, -0.2, 0.5}, {0.01, -0.02, 0.03});
  const std::vector<std::pair<std::string, DistanceShape>> shapes{{"plane", PlaneShape{}},
                                                                  {"ball", BallShape{0.04}},
                                                                  {"capsule", CapsuleShape{0.02, 0.05}},
                                                                  {"box", BoxShape{{0.03, 0.05, 0.02}}},
                                                                  {"ring", RingShape{0.03, 0.06, 0.01}},
                                                                  {"bowl", BowlShape{0.06}}};
  constexpr double kStep_m = 1e-6;
  constexpr double kCurvature = 2e-3;  // of a step on a radius of half a millimetre
  RandomPlaces places;
  for (const auto& [name, shape] : shapes) {
    const DistanceBody body{shape, frame};
    int outside = 0;
    for (int i = 0; i < 300; ++i) {
      const Vec3 p = places.inCube(0.1);
      const NearestSurface nearest = body.nearest(p, 0);
      if (nearest.distance_m < 1e-3) continue;  // inside the distance has edges
      ++outside;
      EXPECT_NEAR(norm(nearest.outward), 1, 1e-12) << name;
      EXPECT_NEAR(body.nearest(p - nearest.distance_m * nearest.outward, 0).distance_m, 0, 1e-12) << name;
      for (const Vec3& axis : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}}) {
        const double rise = (body.nearest(p + kStep_m * axis, 0).distance_m - nearest.distance_m) / kStep_m;
        EXPECT_NEAR(rise, dot(axis, nearest.outward), kCurvature) << name;
      }
    }
    EXPECT_GT(outside, 50) << name;
  }
}

TEST(DistanceScene, SeesABallWhereTheRayMeetsItInClosedForm) {
  const RigidFrame frame{.origin_m = {0.02, -0.01, -0.9}};
  const DistanceScene scene = sceneOf({{BallShape{0.05}, frame}});
  const BodyScene exact({BallBody{0.05}}, frame, {}, {}, 1);
  const drivers::SceneCamera camera{rt::DepthModelParameters{}};
  int seen = 0;
  for (double row = 180.3; row < 310; row += 3) {
    for (double column = 290.2; column < 420; column += 3) {
      const double depth = scene.trueDepth(camera.rayThrough(column, row), 0);
      const double exact_depth = exact.trueDepth(column, row, 0);
      if (std::isfinite(exact_depth)) ++seen;
      // a ray that comes within 0.1 um of the limb counts as meeting it, 0.1 mm before its nearest place
      if (std::isfinite(depth) && std::isfinite(exact_depth)) {
        EXPECT_NEAR(depth, exact_depth, 1e-4);
      } else {
        EXPECT_EQ(std::isfinite(depth), std::isfinite(exact_depth));
      }
    }
  }
  EXPECT_GT(seen, 200);
}

TEST(DistanceScene, LeavesOutGapsAndWhatItDoesNotSee) {
  const RigidFrame frame{.origin_m = {0, 0, -1}};
  DistanceScene scene({{PlaneShape{}, frame}}, {{99.5, 109.5, 49.5, 59.5}}, {}, 1);
  const auto image = std::make_unique<rt::DepthFrame>();
  scene.render(0, 1, SceneNoise::quantised, *image);
  const auto missing = std::ranges::count(image->image(), drivers::kKinectNoMeasurement);
  EXPECT_EQ(missing, 100);
}

TEST(GodObject, IsHeldByABallAtThePlaceNearestToTheHip) {
  const DistanceScene scene = sceneOf({{BallShape{0.03}, {}}});
  GodObject ideal(scene);
  ideal.follow({0, 0, 0.031}, 0);
  for (double z = 0.031; z > 0.022; z -= kTick_m) ideal.follow({0, 0, z}, 0);
  for (double angle = 0; angle < 1.5; angle += kTick_m / 0.022) {
    const Vec3 towards{std::sin(angle), 0, std::cos(angle)};
    EXPECT_LT(norm(ideal.follow(0.022 * towards, 0) - 0.03 * towards), 1e-8) << angle;
  }
}

TEST(GodObject, IsHeldByTheEdgeOfAHollowAndLeavesItAlongAWall) {
  const DistanceScene scene = sceneOf(innerEdge());
  const HollowBody exact{{{{0, 0, 1}, 0}, {{1, 0, 0}, 0}}};
  GodObject ideal(scene);
  HoldingSide side;
  ideal.follow({0.02, 0, 0.02}, 0);
  const auto expect_held = [&](const Vec3& hip) {
    const auto held = exact.hold(hip, hip, side);
    EXPECT_LT(norm(ideal.follow(hip, 0) - (held ? held->proxy_m : hip)), 1e-8) << hip.x << " " << hip.z;
  };
  for (double s = 0.02; s > -0.006; s -= kTick_m) expect_held({s, 0.001, s});
  for (double x = -0.006; x < 0.03; x += kTick_m) expect_held({x, 0.001, -0.006});
}

TEST(GodObject, StaysOnTheFaceThatItCameToThoughAnotherIsNearer) {
  const DistanceScene scene = sceneOf({{BoxShape{{0.05, 0.05, 0.02}}, {}}});
  GodObject ideal(scene);
  Vec3 hip{0.047, 0, 0.025};
  for (; hip.z > 0.012; hip.z -= kTick_m) ideal.follow(hip, 0);
  EXPECT_LT(norm(ideal.follow(hip, 0) - Vec3{0.047, 0, 0.02}), 1e-8);
  for (; hip.x < 0.0505; hip.x += kTick_m) ideal.follow(hip, 0);
  EXPECT_LT(norm(ideal.follow(hip, 0) - hip), 1e-8);  // over the edge nothing holds it
}

TEST(GodObject, NeverEntersABody) {
  const DistanceScene scene = sceneOf({{BallShape{0.04}, {.origin_m = {-0.04, 0, 0}}},
                                       {BallShape{0.04}, {.origin_m = {0.04, 0, 0}}},
                                       {RingShape{0.03, 0.06, 0.01}, {.origin_m = {0, 0, -0.02}}}});
  RandomPlaces places;
  GodObject ideal(scene);
  Vec3 hip{0, 0, 0.06};
  for (int corner = 0; corner < 40; ++corner) {
    const Vec3 to = places.inCube(0.05);
    const int ticks = 1 + static_cast<int>(norm(to - hip) / kTick_m);
    for (int tick = 1; tick <= ticks; ++tick) {
      const Vec3 proxy = ideal.follow(hip + (1.0 * tick / ticks) * (to - hip), 0);
      ASSERT_GT(scene.signedDistance(proxy, 0), -1e-9);
    }
    hip = to;
  }
}

std::vector<GodObjectTick> pressedTicks() {
  std::vector<GodObjectTick> ticks(100);
  for (GodObjectTick& tick : ticks) tick.force_n = {0, 0, 3};
  return ticks;
}

TEST(SceneJudge, TellsContactThatIsLostFromForceThatPointsAside) {
  const std::vector<GodObjectTick> truth = pressedTicks();
  std::vector<GodObjectForce> output(truth.size(), {{0, 0, 3}, {0, 0, 3}});
  for (std::size_t i = 40; i < 50; ++i) output[i].law_n = {};
  for (std::size_t i = 50; i < 55; ++i) output[i].law_n = {3, 0, 0};
  const GodObjectFigures figures = judgeScene(truth, output, 0.002, 500);
  EXPECT_EQ(figures.contact_ticks, 100);
  EXPECT_EQ(figures.lost_ticks, 10);
  EXPECT_EQ(figures.aside_ticks, 5);
  EXPECT_NEAR(figures.step_n, 3 * std::sqrt(2.0), 1e-12);  // from (3, 0, 0) to (0, 0, 3)
  EXPECT_EQ(figures.true_step_n, 0);
}

TEST(SceneJudge, FindsTheEnergyThatALoopGives) {
  std::vector<GodObjectTick> truth;
  std::vector<GodObjectForce> output;
  constexpr int kTicks = 1000;
  constexpr double kRadius_m = 0.02;
  constexpr double kForce_n = 0.5;  // along the circle
  for (int i = 0; i <= kTicks; ++i) {
    const double angle = 2 * M_PI * i / kTicks;
    GodObjectTick tick;
    tick.hip_m = kRadius_m * Vec3{std::cos(angle), std::sin(angle), 0};
    tick.loop = 0;
    truth.push_back(tick);
    const Vec3 force = kForce_n * Vec3{-std::sin(angle), std::cos(angle), 0};
    output.push_back({force, force});
  }
  const GodObjectFigures figures = judgeScene(truth, output, 1, 500);
  EXPECT_EQ(figures.loops, 1);
  EXPECT_NEAR(figures.loop_j, 2 * M_PI * kRadius_m * kForce_n, 1e-5);  // of chords, not arcs
}

}  // namespace
}  // namespace hapticd::tools
