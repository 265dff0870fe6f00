// SPDX-License-Identifier: Apache-2.0
// The analytic scenes against methods that do not share their closed forms: rays against distances, closest
// points against a dense sampling of what the camera sees, normals against finite differences.

#include "tools/lib/truth/true_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

struct NamedScene {
  std::string name;
  TrueSceneParameters parameters;
};

std::vector<NamedScene> allScenes() {
  std::vector<NamedScene> scenes;
  const auto add = [&scenes](const char* name, TrueSceneParameters parameters) {
    scenes.push_back({name, parameters});
  };
  add("plane", {.kind = SceneKind::plane, .distance_m = 0.6});
  add("tilted plane", {.kind = SceneKind::plane, .distance_m = 0.8, .tilt_rad = std::numbers::pi / 6});
  add("steep plane", {.kind = SceneKind::plane, .tilt_rad = std::numbers::pi / 3});
  add("moving plane", {.kind = SceneKind::plane, .distance_m = 1.2, .speed_m_per_s = 0.5});
  add("sphere", {.kind = SceneKind::sphere});
  add("bowl", {.kind = SceneKind::bowl, .distance_m = 0.9});
  add("cylinder", {.kind = SceneKind::cylinder, .distance_m = 0.7, .radius_m = 0.02});
  add("convex edge", {.kind = SceneKind::convex_edge});
  add("half plane", {.kind = SceneKind::half_plane});
  add("inner corner", {.kind = SceneKind::inner_corner, .distance_m = 1.1});
  add("thin plate", {.kind = SceneKind::thin_plate});
  add("step", {.kind = SceneKind::step, .distance_m = 0.8});
  return scenes;
}

Vec3 rayOf(const rt::DepthModelParameters& model, int column, int row) {
  return {(column - model.cx_px) / model.fx_px, -(row - model.cy_px) / model.fy_px, -1};
}

/// What the camera sees within `radius_m` of `centre`, pixel by pixel.
std::vector<Vec3> seenNear(const TrueScene& scene, const Vec3& centre, double radius_m, double t_s) {
  std::vector<Vec3> points;
  for (int row = 0; row < drivers::kKinectHeight; ++row) {
    for (int column = 0; column < drivers::kKinectWidth; ++column) {
      const double depth = scene.trueDepth(column, row, t_s);
      const Vec3 point = depth * rayOf(scene.depthModel(), column, row);
      if (depth > 0 && norm(point - centre) < radius_m) points.push_back(point);
    }
  }
  return points;
}

Vec3 randomIn(std::mt19937& random, double half_edge_m) {
  std::uniform_real_distribution<double> coordinate(-half_edge_m, half_edge_m);
  const double x = coordinate(random);
  const double y = coordinate(random);
  return {x, y, coordinate(random)};
}

TEST(TrueScene, WhatTheCameraSeesLiesOnTheSurface) {
  for (const NamedScene& named : allScenes()) {
    const TrueScene scene(named.parameters);
    double worst_m = 0;
    int seen = 0;
    for (int row = 0; row < drivers::kKinectHeight; row += 3) {
      for (int column = 0; column < drivers::kKinectWidth; column += 3) {
        const double depth = scene.trueDepth(column, row, 0.1);
        if (!(depth > 0) || depth > 20) continue;
        const double distance_m = scene.signedDistance(depth * rayOf(scene.depthModel(), column, row), 0.1);
        worst_m = std::max(worst_m, std::abs(distance_m));
        ++seen;
      }
    }
    // coordinates below 20 m in double precision are good to 4e-15 m
    EXPECT_LT(worst_m, 1e-9) << named.name;
    EXPECT_GT(seen, 100) << named.name;
  }
}

TEST(TrueScene, NothingIsInFrontOfWhatTheCameraSees) {
  for (const NamedScene& named : allScenes()) {
    const TrueScene scene(named.parameters);
    for (int row = 5; row < drivers::kKinectHeight; row += 31) {
      for (int column = 5; column < drivers::kKinectWidth; column += 31) {
        const double depth = scene.trueDepth(column, row, 0);
        const double end = depth > 0 ? depth - 1e-6 : 3;
        for (double z = 0.3; z < std::min(end, 3.0); z += 0.002) {
          const double distance_m = scene.signedDistance(z * rayOf(scene.depthModel(), column, row), 0);
          ASSERT_GT(distance_m, 0) << named.name << ' ' << column << ' ' << row << ' ' << z;
        }
      }
    }
  }
}

TEST(TrueScene, ItIsSolidRightBehindWhatTheCameraSees) {
  for (const NamedScene& named : allScenes()) {
    const TrueScene scene(named.parameters);
    for (int row = 5; row < drivers::kKinectHeight; row += 7) {
      for (int column = 5; column < drivers::kKinectWidth; column += 7) {
        const double depth = scene.trueDepth(column, row, 0);
        if (!(depth > 0) || depth > 20) continue;
        EXPECT_LT(scene.signedDistance((depth + 1e-6) * rayOf(scene.depthModel(), column, row), 0), 0)
            << named.name << ' ' << column << ' ' << row;
      }
    }
  }
}

TEST(TrueScene, NoPointThatTheCameraSeesIsCloserThanTheClosestVisibleOne) {
  std::mt19937 random(1);
  for (const NamedScene& named : allScenes()) {
    // several sheets are treated below
    if (named.name == "thin plate" || named.name == "step") continue;
    const TrueScene scene(named.parameters);
    const double t_s = 0.2;
    const Vec3 middle = scene.approach(t_s).surface_m_in_world;
    const std::vector<Vec3> seen = seenNear(scene, middle, 0.15, t_s);
    ASSERT_GT(seen.size(), 100U) << named.name;
    for (int i = 0; i < 200; ++i) {
      const Vec3 p = middle + randomIn(random, 0.03);
      const Vec3 closest = scene.closestVisible(p, t_s);
      double sampled_m = 1;
      for (const Vec3& point : seen) sampled_m = std::min(sampled_m, norm(p - point));
      EXPECT_LE(norm(p - closest), sampled_m + 1e-12) << named.name;
      EXPECT_NEAR(scene.signedDistance(closest, t_s), 0, 1e-12) << named.name;
      // and the camera sees it; at the limb of a ball the sight grazes the surface
      for (double share = 0.8; share < 1; share += 0.002) {
        ASSERT_GT(scene.signedDistance(share * closest, t_s), -1e-12) << named.name;
      }
    }
  }
}

TEST(TrueScene, BehindASheetTheClosestPointStaysOnThatSheet) {
  constexpr double kRounding_m = 1e-15;  // of coordinates near 1 m
  const TrueScene plate({.kind = SceneKind::thin_plate});
  // 40 mm behind the front, thus 30 mm behind the back, and still 105 mm in front of the wall
  EXPECT_EQ(plate.closestVisible({0.01, 0.02, -1.04}, 0), (Vec3{0.01, 0.02, -1}));
  EXPECT_NEAR(plate.penetration({0.01, 0.02, -1.04}, 0), 0.04, kRounding_m);
  EXPECT_GT(plate.signedDistance({0.01, 0.02, -1.04}, 0), 0);
  // beside the plate the sight is free up to the wall
  EXPECT_EQ(plate.penetration({0.05, 0, -1.04}, 0), 0);
  EXPECT_EQ(plate.closestVisible({0.05, 0, -1.16}, 0), (Vec3{0.05, 0, -1.15}));

  const TrueScene step({.kind = SceneKind::step});
  // the lower level's edge is 5 mm away, but the HIP went in through the upper level
  EXPECT_EQ(step.closestVisible({-0.005, 0, -1.02}, 0), (Vec3{-0.005, 0, -1}));
  EXPECT_NEAR(step.penetration({-0.005, 0, -1.02}, 0), 0.02, kRounding_m);
  EXPECT_NEAR(step.penetration({0.005, 0, -1.02 - 0.003}, 0), 0.003, kRounding_m);
  EXPECT_EQ(step.penetration({0.005, 0, -1.019}, 0), 0);
}

TEST(TrueScene, NormalsAreTheGradientOfTheDistance) {
  constexpr double kStep_m = 1e-6;
  for (const NamedScene& named : allScenes()) {
    const TrueScene scene(named.parameters);
    const Vec3 middle = scene.approach(0).surface_m_in_world;
    int compared = 0;
    for (const Vec3& point : seenNear(scene, middle, 0.1, 0)) {
      // a hidden side or another face may be closer than the step where pieces meet
      const bool at_a_seam = std::abs(point.x) < 0.001 || std::abs(std::abs(point.x) - 0.03) < 0.001;
      const Vec3 from_rim = point - Vec3{0, 0, middle.z + 0.05};
      const bool at_the_rim = named.name == "bowl" && std::abs(from_rim.z) < 0.001;
      if (at_a_seam || at_the_rim) continue;
      const auto slope = [&](const Vec3& direction) {
        return (scene.signedDistance(point + kStep_m * direction, 0) -
                scene.signedDistance(point - kStep_m * direction, 0)) /
               (2 * kStep_m);
      };
      const Vec3 gradient{slope({1, 0, 0}), slope({0, 1, 0}), slope({0, 0, 1})};
      // central differences of 1e-6 m: 1e-12 / R^2 of the curvature and 1e-16 / 1e-6 of the rounding
      ASSERT_LT(norm(gradient - scene.normal(point, 0)), 1e-8) << named.name;
      ++compared;
    }
    EXPECT_GT(compared, 100) << named.name;
  }
}

TEST(TrueScene, TheHipIsPushedInThroughAPointThatTheCameraSees) {
  for (const NamedScene& named : allScenes()) {
    const TrueScene scene(named.parameters);
    const TrueScene::Approach approach = scene.approach(0.3);
    EXPECT_NEAR(norm(approach.inward_in_world), 1, 1e-12) << named.name;
    EXPECT_NEAR(scene.signedDistance(approach.surface_m_in_world, 0.3), 0, 1e-12) << named.name;
    EXPECT_GT(scene.penetration(approach.surface_m_in_world + 1e-6 * approach.inward_in_world, 0.3), 0)
        << named.name;
    EXPECT_LT(dot(scene.normal(approach.surface_m_in_world, 0.3), approach.inward_in_world), -0.7)
        << named.name;
    EXPECT_EQ(scene.penetration(approach.surface_m_in_world - 0.03 * approach.inward_in_world, 0.3), 0)
        << named.name;
  }
}

TEST(TrueScene, AMovingPlaneIsAsFarAsItsSpeedSays) {
  const TrueScene scene({.kind = SceneKind::plane, .distance_m = 1.2, .speed_m_per_s = 0.5});
  EXPECT_DOUBLE_EQ(scene.trueDepth(100, 100, 0), 1.2);
  EXPECT_DOUBLE_EQ(scene.trueDepth(100, 100, 0.4), 1.0);
}

/// The raw values that a frame and a model stand for, as depth, against the truth.
double largestDepthError(const TrueSceneParameters& parameters, const rt::DepthModelParameters& model,
                         int& valid) {
  TrueScene scene(parameters, model);
  const auto frame = std::make_unique<rt::DepthFrame>();
  scene.render(0, 1, SceneNoise::none, *frame);
  double worst = 0;  // share of what half a raw unit is worth there
  valid = 0;
  for (int row = 0; row < drivers::kKinectHeight; ++row) {
    for (int column = 0; column < drivers::kKinectWidth; ++column) {
      const std::uint16_t raw = frame->raw[row * drivers::kKinectWidth + column];
      if (raw == drivers::kKinectNoMeasurement) continue;
      ++valid;
      const double inverse = model.a_per_m * raw + model.b_per_m;
      const double truth = scene.trueDepth(column, row, 0);
      worst = std::max(worst, std::abs(inverse - 1 / truth) / std::abs(0.5 * model.a_per_m));
    }
  }
  return worst;
}

TEST(TrueScene, RendersEveryPixelToHalfARawUnit) {
  for (const NamedScene& named : allScenes()) {
    int coarse = 0;
    int fine = 0;
    // disparities are kept in single precision: 2^-13 of a unit near 2000
    EXPECT_LE(largestDepthError(named.parameters, {}, coarse), 1 + 0x1p-12) << named.name;
    const double distance_m = named.parameters.distance_m;
    EXPECT_LE(largestDepthError(named.parameters, fineDepthModelAround(distance_m, 0.1), fine), 1 + 0x1p-12)
        << named.name;
    EXPECT_GT(coarse, 500) << named.name;
    EXPECT_GT(fine, 500) << named.name;
  }
}

TEST(TrueScene, NoiseDependsOnTheFrameNumberAloneAndIsASensors) {
  TrueScene scene({.kind = SceneKind::plane});
  const auto first = std::make_unique<rt::DepthFrame>();
  const auto second = std::make_unique<rt::DepthFrame>();
  scene.render(0, 1, SceneNoise::sensor, *first);
  scene.render(0, 2, SceneNoise::sensor, *second);
  EXPECT_FALSE(std::ranges::equal(first->image(), second->image()));
  scene.render(0.5, 1, SceneNoise::sensor, *second);
  EXPECT_TRUE(std::ranges::equal(first->image(), second->image()));
  EXPECT_EQ(second->sequence, 1U);
  EXPECT_EQ(second->arrival_ns, 500'000'000);
  EXPECT_EQ(first->raw[drivers::kKinectWidth - 1],
            drivers::kKinectNoMeasurement);  // the camera's dead columns
}

TEST(TrueScene, NothingIsMeasuredOutsideNearAndFar) {
  rt::DepthModelParameters model;
  model.near_m = 0.95;
  model.far_m = 1.05;
  for (const SceneNoise noise : {SceneNoise::quantised, SceneNoise::sensor, SceneNoise::harsh}) {
    TrueScene scene({.kind = SceneKind::inner_corner}, model);
    const auto frame = std::make_unique<rt::DepthFrame>();
    scene.render(0, 1, noise, *frame);
    int valid = 0;
    for (const std::uint16_t raw : frame->image()) {
      if (raw == drivers::kKinectNoMeasurement) continue;
      const double depth = 1 / (model.a_per_m * raw + model.b_per_m);
      ASSERT_TRUE(depth >= model.near_m && depth <= model.far_m);
      ++valid;
    }
    EXPECT_GT(valid, 1000);
  }
}

TEST(FineDepthModel, SpreadsItsRawValuesOverTheRange) {
  const rt::DepthModelParameters model = fineDepthModel(0.9, 1.1);
  const auto depth = [&model](int raw) { return 1 / (model.a_per_m * raw + model.b_per_m); };
  EXPECT_NEAR(depth(0), 0.9, 1e-12);
  EXPECT_NEAR(depth(2046), 1.1, 1e-12);
  EXPECT_GE(depth(0), model.near_m);
  EXPECT_LE(depth(2046), model.far_m);
  EXPECT_NEAR(1 / depth(1023), (1 / 0.9 + 1 / 1.1) / 2, 1e-12);
  // |a| Z^2 with the middle's Z^2 = 0.99^2, up to the change of Z within a unit
  EXPECT_NEAR(depth(1024) - depth(1023), (1 / 0.9 - 1 / 1.1) / 2046 * 0.99 * 0.99, 1e-7);
}

TEST(FineDepthModel, StandsForItsMiddleExactly) {
  for (const double middle_m : {0.6, 1.0, 3.5}) {
    const rt::DepthModelParameters model = fineDepthModelAround(middle_m, 0.1);
    EXPECT_NEAR(1 / (model.a_per_m * 1023 + model.b_per_m), middle_m, 1e-12);
    EXPECT_NEAR(1 / (model.a_per_m * 2046 + model.b_per_m), middle_m + 0.1, 1e-12);
  }
}

}  // namespace
}  // namespace hapticd::tools
