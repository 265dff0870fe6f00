// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <tuple>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "rt/laws/nearest_springs.h"
#include "tests/unit/rt/rounding_tolerance.h"
#include "tests/unit/rt/scene/built_scene.h"
#include "tests/unit/rt/scene/made_up_frame.h"
#include "tests/unit/rt/simd_targets.h"
#include "tools/lib/oracle/reference_camera.h"

namespace hapticd::rt {
namespace {

using test::BuiltScene;
using tools::ReferenceCamera;

/// A plane at 1 m with 2 mm between points and the optical axis in the middle of four pixels: on the axis,
/// points come in groups of four and eight at bitwise equal distances.
DepthModelParameters symmetricCamera() {
  DepthModelParameters m;
  m.fx_px = m.fy_px = 500;
  m.cx_px = 319.5;
  m.cy_px = 239.5;
  m.a_per_m = -0x1p-10;
  m.b_per_m = 2;  // raw 1024 is 1 m
  return m;
}
constexpr std::uint16_t kOneMetre = 1024;

struct LatticePoint {
  int column, row;
  Vec3 position;
};

/// The lattice's points in the order in which the law must choose them from the axis: by distance in
/// integers, ties in image order.
std::vector<LatticePoint> latticeInOrderOfChoice() {
  std::vector<LatticePoint> points;
  for (int row = 220; row < 260; ++row) {
    for (int column = 300; column < 340; ++column) {
      points.push_back({column, row, {(column - 319.5) / 500, (239.5 - row) / 500, -1}});
    }
  }
  const auto rank = [](const LatticePoint& p) {
    const int x = 2 * p.column - 639;
    const int y = 2 * p.row - 479;
    return std::tuple(x * x + y * y, p.row, p.column);
  };
  std::sort(points.begin(), points.end(),
            [&](const LatticePoint& a, const LatticePoint& b) { return rank(a) < rank(b); });
  return points;
}

Vec3 meanSpring(const Vec3& hip, const std::vector<LatticePoint>& points, std::size_t count,
                const SpringParameters& parameters) {
  Vec3 sum;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 v = hip - points[i].position;
    sum += (parameters.stiffness_n_per_m * (parameters.radius_m - norm(v)) / norm(v)) * v;
  }
  return (1.0 / static_cast<double>(count)) * sum;
}

class NeighbourChoice : public test::EachSimdTarget {};

TEST_P(NeighbourChoice, ChoosesTheFirstPixelsOfTheImageAmongEquallyFarPoints) {
  const auto model = std::make_unique<DepthModel>(symmetricCamera(), PoseParameters{});
  const std::vector<LatticePoint> order = latticeInOrderOfChoice();
  for (const ModelExtent extent : {ModelExtent::reach, ModelExtent::frame}) {
    GridParameters grid;
    grid.extent = extent;
    BuiltScene built(*model, grid);
    SearchMemory memory(built.builder.pointCapacity());
    built.build(*test::frameOf(kOneMetre), {0, 0, -1});
    for (const double h : {0.0, 0.003, 0.02}) {
      for (int count = 1; count <= 200; ++count) {
        const SpringParameters parameters{500, 0.04, 1, count};
        const Vec3 hip{0, 0, -1 + h};
        const ForceSample sample = nearestSprings(built.scene, hip, parameters, memory);
        const Vec3 expected = meanSpring(hip, order, static_cast<std::size_t>(count), parameters);
        ASSERT_EQ(sample.points_used, static_cast<std::uint32_t>(count));
        // Rounding only; one other chosen point changes the force by at least 20 N * 2 mm / 40 mm / 200.
        ASSERT_LT(norm(sample.force_n_in_world - expected), test::roundingTolerance_n(parameters)) << count;
      }
    }
  }
}

/// Frames with few measurements, all at 1 m.
class FewPoints {
 public:
  FewPoints()
      : model_(std::make_unique<DepthModel>(symmetricCamera(), PoseParameters{})), built_(*model_, {}) {}

  void show(const std::vector<std::pair<int, int>>& pixels) {
    const test::FramePointer frame = test::frameOf(drivers::kKinectNoMeasurement);
    for (const auto& [u, v] : pixels) frame->raw[v * drivers::kKinectWidth + u] = kOneMetre;
    built_.build(*frame, {0, 0, -1});
  }
  /// Shows `count` pixels around the axis, no two at the same distance from (0.1 mm, 0.3 mm) beside it.
  void showPixels(int count) {
    std::vector<std::pair<int, int>> pixels;
    for (int i = 0; i < count; ++i) pixels.emplace_back(315 + i % 10, 235 + i / 10);
    show(pixels);
  }
  ForceSample evaluate(const Vec3& hip, const SpringParameters& parameters) {
    return nearestSprings(built_.scene, hip, parameters, memory_);
  }
  const ReferenceCamera& camera() const { return camera_; }

 private:
  ReferenceCamera camera_{symmetricCamera()};
  std::unique_ptr<DepthModel> model_;
  BuiltScene built_;
  SearchMemory memory_{drivers::kKinectPixels};
};

TEST_P(NeighbourChoice, GivesNoForceBelowNMinPointsAndOneFromNMinOn) {
  FewPoints few;
  const Vec3 hip{0.0001, 0.0003, -0.99};
  for (const int min_points : {1, 2, 10, 37}) {
    const SpringParameters parameters{500, 0.04, min_points, 100};
    few.showPixels(min_points - 1);
    const ForceSample too_few = few.evaluate(hip, parameters);
    EXPECT_EQ(too_few.points_used, 0U);
    EXPECT_EQ(too_few.force_n_in_world, Vec3{});
    few.showPixels(min_points);
    const ForceSample enough = few.evaluate(hip, parameters);
    EXPECT_EQ(enough.points_used, static_cast<std::uint32_t>(min_points));
    EXPECT_GT(enough.force_n_in_world.z, 5);
  }
}

TEST_P(NeighbourChoice, CountsForNMinOnlyThePointsWithinTheRadius) {
  FewPoints few;
  // Ten points 10 mm below, one of them 41 mm to the side.
  few.show({{316, 239},
            {317, 239},
            {318, 239},
            {319, 239},
            {320, 239},
            {321, 239},
            {322, 239},
            {323, 239},
            {324, 239},
            {340, 239}});
  EXPECT_EQ(few.evaluate({0, 0, -0.99}, {500, 0.04, 10, 100}).points_used, 0U);
  EXPECT_EQ(few.evaluate({0, 0, -0.99}, {500, 0.04, 9, 100}).points_used, 9U);
  EXPECT_EQ(few.evaluate({0, 0, -0.99}, {500, 0.043, 10, 100}).points_used, 10U);
}

TEST_P(NeighbourChoice, UsesAllPointsUpToNMaxAndDropsTheFarthestBeyond) {
  FewPoints few;
  const Vec3 hip{0.0001, 0.0003, -0.99};
  const SpringParameters parameters{500, 0.04, 1, 50};
  for (const int shown : {49, 50, 51, 90}) {
    few.showPixels(shown);
    std::vector<LatticePoint> points;
    for (int i = 0; i < shown; ++i) {
      const int column = 315 + i % 10;
      const int row = 235 + i / 10;
      points.push_back({column, row, {(column - 319.5) / 500, (239.5 - row) / 500, -1}});
    }
    std::sort(points.begin(), points.end(), [&](const LatticePoint& a, const LatticePoint& b) {
      return norm(hip - a.position) < norm(hip - b.position);
    });
    const std::size_t used = std::min<std::size_t>(points.size(), 50);
    const ForceSample sample = few.evaluate(hip, parameters);
    EXPECT_EQ(sample.points_used, used);
    EXPECT_LT(norm(sample.force_n_in_world - meanSpring(hip, points, used, parameters)),
              test::roundingTolerance_n(parameters));
  }
}

TEST_P(NeighbourChoice, LetsAPointThatCoincidesWithTheHipCountWithoutForce) {
  FewPoints few;
  few.show({{320, 239}, {330, 239}});
  const Vec3 point = few.camera().pointInWorld(320, 239, kOneMetre);
  const SpringParameters parameters{500, 0.04, 1, 100};
  // The other point is 20 mm to the right: 500 * (0.04 - 0.02) = 10 N to the left, halved by N = 2.
  for (const double off_m : {0.0, 0.5e-9}) {
    const ForceSample sample = few.evaluate(point + Vec3{0, 0, off_m}, parameters);
    EXPECT_EQ(sample.points_used, 2U);
    // 0.5 nm * 500 N/m, and a similarly small change of direction.
    EXPECT_NEAR(sample.force_n_in_world.x, -5, 1e-6);
    EXPECT_NEAR(sample.force_n_in_world.y, 0, 1e-6);
    EXPECT_NEAR(sample.force_n_in_world.z, 0, 1e-6);
  }
  // Slightly farther away, its spring contributes the full k D / N = 10 N; positions are rounded to 1e-16 m
  // of 4e-9.
  const ForceSample sample = few.evaluate(point + Vec3{0, 0, 4e-9}, parameters);
  EXPECT_NEAR(sample.force_n_in_world.z, 10, 1e-5);
}

TEST_P(NeighbourChoice, GivesZeroForceOnASinglePoint) {
  FewPoints few;
  few.show({{320, 239}});
  const ForceSample sample =
      few.evaluate(few.camera().pointInWorld(320, 239, kOneMetre), {500, 0.04, 1, 100});
  EXPECT_EQ(sample.points_used, 1U);
  EXPECT_EQ(sample.force_n_in_world, Vec3{});
}

TEST_P(NeighbourChoice, GivesNoForceWhereNothingIsModelled) {
  FewPoints few;
  few.show({});
  EXPECT_EQ(few.evaluate({0, 0, -1}, {500, 0.04, 1, 100}).points_used, 0U);
  SearchMemory memory(16);
  const ForceSample sample = nearestSprings(Scene{}, {0, 0, -1}, {}, memory);
  EXPECT_EQ(sample.points_used, 0U);
  EXPECT_EQ(sample.force_n_in_world, Vec3{});
}

HAPTICD_FOR_EACH_SIMD_TARGET(NeighbourChoice);

}  // namespace
}  // namespace hapticd::rt
