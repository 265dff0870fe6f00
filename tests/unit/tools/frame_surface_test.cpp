// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/accuracy/frame_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "tools/truth/true_scene.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

/// The disparities of a scene, not rounded to raw values.
std::vector<float> exactDisparities(const TrueScene& scene) {
  const rt::DepthModelParameters& camera = scene.depthModel();
  std::vector<float> disparity;
  for (int row = 0; row < rt::kFrameHeight; ++row) {
    for (int column = 0; column < rt::kFrameWidth; ++column) {
      const double depth = scene.trueDepth(column, row, 0);
      disparity.push_back(depth > 0 ? static_cast<float>((1 / depth - camera.b_per_m) / camera.a_per_m)
                                    : -1.0F);
    }
  }
  return disparity;
}

/// Largest distance between what the search finds and the true closest point, over places behind the surface.
double largestMiss_m(const TrueSceneParameters& parameters) {
  const TrueScene scene(parameters);
  const std::vector<float> disparity = exactDisparities(scene);
  FrameSurface surface(disparity.data(), scene.depthModel());
  std::mt19937 random(3);
  std::uniform_real_distribution<double> aside_m(-0.01, 0.01);
  std::uniform_real_distribution<double> deep_m(0.001, 0.03);
  const TrueScene::Approach approach = scene.approach(0);
  double worst_m = 0;
  for (int i = 0; i < 100; ++i) {
    const Vec3 foot = approach.surface_m_in_world + Vec3{aside_m(random), aside_m(random), 0};
    const Vec3 hip = foot + (deep_m(random) + 0.01) * approach.inward_in_world;
    if (scene.penetration(hip, 0) == 0) continue;
    const auto found = surface.closestBehind(hip, 0.06);
    EXPECT_TRUE(found.has_value());
    if (found) worst_m = std::max(worst_m, norm(*found - scene.closestVisible(hip, 0)));
  }
  return worst_m;
}

// 1/Z of a plane is linear in the pixel, so that the interpolation is exact; disparities in single precision
// are good to 2^-14 units of 3 mm, and the search to 1e-3 of a cell of 1.7 mm times 1.6 (its diagonal, 60
// degrees).
constexpr double kPlaneTolerance_m = 5e-6;

TEST(FrameSurface, FindsTheFootOnAPlane) {
  EXPECT_LT(largestMiss_m({.kind = SceneKind::plane}), kPlaneTolerance_m);
  EXPECT_LT(largestMiss_m({.kind = SceneKind::plane, .tilt_rad = std::numbers::pi / 6}), kPlaneTolerance_m);
  EXPECT_LT(largestMiss_m({.kind = SceneKind::plane, .distance_m = 0.7, .tilt_rad = std::numbers::pi / 3}),
            kPlaneTolerance_m);
}

TEST(FrameSurface, FindsTheClosestPointOnASphere) {
  // The chord over a pixel of 1.7 mm lies below the sphere of 50 mm by up to 1.7^2 / (8 * 50) = 0.007 mm in
  // each of two directions; that moves the closest point for a HIP up to 40 mm deep by sqrt(2 * 0.014 / (1/40
  // - 1/50)) = 2.4 mm at the most, when seen from near the centre, and by a cell otherwise.
  EXPECT_LT(largestMiss_m({.kind = SceneKind::sphere}), 0.0024);
}

TEST(FrameSurface, StaysOnTheSheetThatTheSightCrosses) {
  const TrueScene scene({.kind = SceneKind::thin_plate});
  const std::vector<float> disparity = exactDisparities(scene);
  FrameSurface surface(disparity.data(), scene.depthModel());
  const auto plate = surface.closestBehind({0.02, 0, -1.04}, 0.06);
  ASSERT_TRUE(plate.has_value());
  EXPECT_LT(norm(*plate - Vec3{0.02, 0, -1}), kPlaneTolerance_m);
  const auto wall = surface.closestBehind({0.05, 0, -1.16}, 0.06);
  ASSERT_TRUE(wall.has_value());
  EXPECT_LT(norm(*wall - Vec3{0.05, 0, -1.15}), kPlaneTolerance_m);
}

TEST(FrameSurface, HoldsNothingBackInFrontOfTheSurface) {
  const TrueScene scene({.kind = SceneKind::plane});
  const std::vector<float> disparity = exactDisparities(scene);
  FrameSurface surface(disparity.data(), scene.depthModel());
  EXPECT_FALSE(surface.closestBehind({0, 0, -0.999}, 0.03).has_value());
  EXPECT_TRUE(surface.closestBehind({0, 0, -1.001}, 0.03).has_value());
}

TEST(FrameSurface, ClosesSmallHolesFromBeside) {
  const TrueScene scene({.kind = SceneKind::plane});
  std::vector<float> disparity = exactDisparities(scene);
  for (int row = 238; row < 248; ++row) {
    for (int column = 335; column < 345; ++column) {
      disparity[static_cast<std::size_t>(row * rt::kFrameWidth + column)] = -1;
    }
  }
  FrameSurface surface(disparity.data(), scene.depthModel());
  const auto closest = surface.closestBehind({0, 0, -1.02}, 0.03);
  ASSERT_TRUE(closest.has_value());
  // on the rim of the hole, at most 5 pixels and their diagonal of 1.7 mm aside
  EXPECT_LT(norm(*closest - Vec3{0, 0, -1}), 0.0125);
  EXPECT_NEAR(closest->z, -1, kPlaneTolerance_m);
}

}  // namespace
}  // namespace hapticd::tools
