// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>

#include "drivers/camera/kinect_image.h"
#include "rt/laws/nearest_springs.h"
#include "tests/unit/rt/rounding_tolerance.h"
#include "tests/unit/rt/scene/built_scene.h"
#include "tests/unit/rt/scene/made_up_frame.h"
#include "tests/unit/rt/simd_targets.h"
#include "tools/lib/oracle/reference_camera.h"
#include "tools/lib/oracle/spring_oracle.h"

namespace hapticd::rt {
namespace {

using test::BuiltScene;
using tools::SpringOracle;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// A lens so long that the whole image, 53 mm by 40 mm at 1 m, fits into one ball.
DepthModelParameters longLens(double nearest_m, double farthest_m) {
  DepthModelParameters m;
  m.fx_px = m.fy_px = 12000;
  m.cx_px = 319.3;
  m.cy_px = 239.8;
  test::spreadRawValuesOver(nearest_m, farthest_m, m);
  return m;
}

/// Compares the force on a frame with brute force, both for the whole frame and for only the reach modelled.
void expectForceOfBruteForce(const DepthModelParameters& parameters, const DepthFrame& frame, const Vec3& hip,
                             std::initializer_list<SpringParameters> springs) {
  const auto model = std::make_unique<DepthModel>(parameters, PoseParameters{});
  const tools::PointCloud cloud = tools::ReferenceCamera(parameters).pointsOf(frame.image());
  GridParameters reach_grid;
  reach_grid.point_capacity = drivers::kKinectPixels;
  BuiltScene reach(*model, reach_grid);
  BuiltScene whole(*model, test::wholeFrameGrid());
  SearchMemory memory(drivers::kKinectPixels);
  reach.build(frame, hip, 0.12);
  whole.build(frame);
  for (const SpringParameters& s : springs) {
    const SpringOracle expected(cloud.points_m, hip, s);
    // Where only rounding decides between points (two of 300 000 equally far to 1e-12 m), another one may
    // have been chosen: 2 k D / N.
    const double either =
        test::isUndecided(expected) ? 2 * s.stiffness_n_per_m * s.radius_m / expected.pointsUsed() : 0;
    for (const Scene* const scene : {&reach.scene, &whole.scene}) {
      const ForceSample sample = nearestSprings(*scene, hip, s, memory);
      EXPECT_EQ(sample.points_used, expected.pointsUsed());
      EXPECT_LE(norm(sample.force_n_in_world - expected.force_n()), test::roundingTolerance_n(s) + either);
    }
  }
}

class HardInput : public test::EachSimdTarget {};

TEST_P(HardInput, AllPixelsWithinTheRadius) {
  const DepthModelParameters parameters = longLens(0.995, 1.005);
  const test::FramePointer frame = test::randomFrame(1, 0, 2046);
  expectForceOfBruteForce(
      parameters, *frame, {0.0011, -0.0007, -0.99},
      {{500, 0.1, 10, 100}, {500, 0.1, 1, 1}, {500, 0.1, 10, 1000}, {500, 0.1, 1, drivers::kKinectPixels}});
}

TEST_P(HardInput, AllPixelsEquallyFar) {
  // A bowl with a radius of 50 mm around the HIP: all distances are equal except for the depth's quantum of 6
  // um.
  constexpr double kRadius_m = 0.05;
  constexpr double kHipDepth_m = 0.96;
  const DepthModelParameters parameters = longLens(kHipDepth_m + 0.037, kHipDepth_m + 0.0505);
  const test::FramePointer frame = test::frameOfDepth(parameters, [&](int u, int v) {
    const double x = (u - parameters.cx_px) / parameters.fx_px;
    const double y = (v - parameters.cy_px) / parameters.fy_px;
    const double length2 = 1 + x * x + y * y;
    return (kHipDepth_m + std::sqrt(kHipDepth_m * kHipDepth_m -
                                    length2 * (kHipDepth_m * kHipDepth_m - kRadius_m * kRadius_m))) /
           length2;
  });
  expectForceOfBruteForce(
      parameters, *frame, {0, 0, -kHipDepth_m},
      {{500, 0.06, 10, 100}, {500, 0.06, 1, 1000}, {500, 0.05, 10, 100}, {500, 0.06, 1, 1}});
}

TEST_P(HardInput, AllPixelsAtOnePlace) {
  // Pixels 0.05 um apart: in single precision, and for the grid, all points coincide.
  DepthModelParameters parameters = longLens(0.999, 1.001);
  parameters.fx_px = parameters.fy_px = 2e7;
  const test::FramePointer frame = test::frameOf(1000);
  const double depth = 1 / (parameters.a_per_m * 1000 + parameters.b_per_m);
  for (const double h : {0.02, 1e-6}) {
    expectForceOfBruteForce(parameters, *frame, {1.3e-6, 0.7e-6, h - depth},
                            {{500, 0.04, 10, 100}, {500, 0.04, 1, 1000}, {500, 0.04, 1, 1}});
  }
}

TEST_P(HardInput, AWallAtTheNearLimit) {
  const DepthModelParameters parameters;
  const test::FramePointer frame = test::frameOf(271);  // 0.4001 m: 11 000 points within 4 cm
  for (const double h : {0.0, 0.001, 0.02, -0.03}) {
    expectForceOfBruteForce(parameters, *frame, {0.0113, -0.0207, -0.40012 + h},
                            {{500, 0.04, 10, 100}, {500, 0.1, 10, 1000}, {500, 0.005, 10, 100}});
  }
}

TEST_P(HardInput, ARadiusThatHoldsExactlyTheNearestPoint) {
  // The reference counts a point at s = D (force 0) as within D, as eq. (7) does.
  DepthModelParameters parameters;
  parameters.a_per_m = -0x1p-10;
  parameters.b_per_m = 2;
  parameters.cx_px = 320;
  parameters.cy_px = 240;
  const test::FramePointer frame = test::frameOf(drivers::kKinectNoMeasurement);
  frame->raw[240 * drivers::kKinectWidth + 320] = 1024;  // (0, 0, -1)
  const auto model = std::make_unique<DepthModel>(parameters, PoseParameters{});
  BuiltScene built(*model, GridParameters{});
  SearchMemory memory(drivers::kKinectPixels);
  built.build(*frame, {0, 0, -1});
  EXPECT_EQ(nearestSprings(built.scene, {0, 0, -0.96875}, {500, 0.03125, 1, 100}, memory).points_used, 1U);
  EXPECT_EQ(nearestSprings(built.scene, {0, 0, -0.96874}, {500, 0.03125, 1, 100}, memory).points_used, 0U);
}

TEST_P(HardInput, AnInvalidOrDistantHipGivesNoForceAndDoesNotDisturbLaterSearches) {
  const auto model = std::make_unique<DepthModel>(DepthModelParameters{}, PoseParameters{});
  const test::FramePointer frame = test::frameOf(760);
  for (const ModelExtent extent : {ModelExtent::reach, ModelExtent::frame}) {
    GridParameters grid;
    grid.extent = extent;
    BuiltScene built(*model, grid);
    SearchMemory memory(drivers::kKinectPixels);
    const Scene& scene = built.build(*frame, {0, 0, -1});
    const ForceSample sound = nearestSprings(scene, {0, 0, -1}, {}, memory);
    ASSERT_EQ(sound.points_used, 100U);
    for (const double bad : {kNaN, kInfinity, -kInfinity, 1e300, -1e300, 1e38, -1e38, 1e6, -1e6, 10.0}) {
      for (const Vec3& hip : {Vec3{bad, 0, -1}, Vec3{0, bad, -1}, Vec3{0, 0, bad}, Vec3{bad, bad, bad}}) {
        const ForceSample sample = nearestSprings(scene, hip, {}, memory);
        EXPECT_EQ(sample.points_used, 0U) << bad;
        EXPECT_EQ(sample.force_n_in_world, Vec3{}) << bad;
        const ForceSample after = nearestSprings(scene, {0, 0, -1}, {}, memory);
        EXPECT_EQ(after.points_used, sound.points_used) << bad;
        EXPECT_LT(norm(after.force_n_in_world - sound.force_n_in_world), 1e-12) << bad;
      }
    }
  }
}

TEST_P(HardInput, ADenormalHipIsZero) {
  // The camera is near the middle of the scene: a wall 0.42 m ahead, with the HIP next to it.
  const auto model = std::make_unique<DepthModel>(DepthModelParameters{}, PoseParameters{{0, 0, 0.42}});
  const test::FramePointer frame = test::frameOf(300);
  BuiltScene built(*model, GridParameters{});
  SearchMemory memory(drivers::kKinectPixels);
  const Scene& scene = built.build(*frame, {0, 0, 0});
  constexpr double kDenormal = 5e-324;
  const ForceSample zero = nearestSprings(scene, {0, 0, 0}, {}, memory);
  const ForceSample denormal = nearestSprings(scene, {kDenormal, -kDenormal, kDenormal}, {}, memory);
  ASSERT_EQ(zero.points_used, 100U);
  EXPECT_EQ(denormal.points_used, 100U);
  EXPECT_LT(norm(denormal.force_n_in_world - zero.force_n_in_world), 1e-12);  // 100 terms in another order
}

HAPTICD_FOR_EACH_SIMD_TARGET(HardInput);

}  // namespace
}  // namespace hapticd::rt
