// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <tuple>
#include <vector>

#include "rt/laws/nearest_springs.h"
#include "tests/unit/rt/scene/made_up_scene.h"
#include "tests/unit/rt/simd_targets.h"

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

constexpr std::size_t kCapacity = 20000;

/// Computes the same forces with a memory that keeps all history and with a new one each time.
class MemoryComparison {
 public:
  MemoryComparison() : remembering_(kCapacity) {}

  void compare(const Scene& scene, const Vec3& hip, const SpringParameters& parameters) {
    const ForceSample with = nearestSprings(scene, hip, parameters, remembering_);
    SearchMemory fresh(kCapacity);
    const ForceSample without = nearestSprings(scene, hip, parameters, fresh);
    touching_ += without.points_used != 0 ? 1 : 0;
    free_ += without.points_used == 0 ? 1 : 0;
    ASSERT_EQ(with.points_used, without.points_used);
    // The same points summed in another order: at most 1000 roundings of 2^-53, relative to k D.
    ASSERT_LE(norm(with.force_n_in_world - without.force_n_in_world),
              1e-13 * parameters.stiffness_n_per_m * parameters.radius_m);
  }

  int touching() const { return touching_; }
  int free() const { return free_; }

 private:
  SearchMemory remembering_;
  int touching_ = 0;
  int free_ = 0;
};

/// A path of a hand: small steps with occasional jumps, in front of and behind the surfaces.
class Wandering {
 public:
  explicit Wandering(std::uint32_t seed) : random_(seed) {}
  const Vec3& next(double step_m) {
    for (double* const coordinate : {&hip_.x, &hip_.y, &hip_.z}) {
      *coordinate += std::uniform_real_distribution(-step_m, step_m)(random_);
    }
    if (below(100) == 0) {
      hip_ = {between(-0.3, 0.3), between(-0.25, 0.25), between(-1.4, -0.8)};
    }
    return hip_;
  }
  double between(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  int below(int count) { return std::uniform_int_distribution(0, count - 1)(random_); }

 private:
  std::mt19937 random_;
  Vec3 hip_{0, 0, -1};
};

/// Scenes of one camera whose ball follows the hand; each is rebuilt occasionally.
class Scenes {
 public:
  Scenes() : model_(std::make_unique<DepthModel>(DepthModelParameters{}, PoseParameters{})) {
    frames_.push_back(test::planeAndSphereFrame(1, {}));
    frames_.push_back(test::planeAndSphereFrame(2, {}));
    frames_.push_back(test::frameOf(drivers::kKinectNoMeasurement));
    frames_.push_back(test::randomFrame(3, 700, 860));
    GridParameters grid;
    grid.point_capacity = kCapacity;
    for (int i = 0; i < 3; ++i) built_.push_back(std::make_unique<BuiltScene>(*model_, grid));
  }
  /// Returns a scene, of some frame, that covers the ball around `hip`.
  const Scene& around(const Vec3& hip, double radius_m, Wandering& hand) {
    BuiltScene& built = *built_[static_cast<std::size_t>(hand.below(100) < 97 ? 0 : 1 + hand.below(2))];
    if (!built.scene.covers(hip, radius_m) || hand.below(33) == 0) {
      built.build(*frames_[static_cast<std::size_t>(hand.below(static_cast<int>(frames_.size())))], hip,
                  radius_m + 0.03);
    }
    return built.scene;
  }

 private:
  std::unique_ptr<DepthModel> model_;
  std::vector<test::FramePointer> frames_;
  std::vector<std::unique_ptr<BuiltScene>> built_;
};

TEST(SearchMemory, NeverChangesTheForceAlongAHandsPath) {
  for (const double step_m : {0.0003, 0.003}) {
    Scenes scenes;
    Wandering hand(4);
    MemoryComparison comparison;
    for (int i = 0; i < 1000; ++i) {
      const Vec3 hip = hand.next(step_m);
      comparison.compare(scenes.around(hip, 0.04, hand), hip, {});
      ASSERT_FALSE(HasFatalFailure()) << i;
    }
    EXPECT_GT(comparison.touching(), 100);
    EXPECT_GT(comparison.free(), 100);
  }
}

TEST(SearchMemory, NeverChangesTheForceWhenParametersChange) {
  Scenes scenes;
  Wandering hand(5);
  MemoryComparison comparison;
  SpringParameters parameters;
  for (int i = 0; i < 1000; ++i) {
    if (hand.below(5) == 0) {
      parameters.radius_m = hand.between(0.005, 0.06);
      parameters.max_points = 1 + hand.below(300);
      parameters.min_points = 1 + hand.below(parameters.max_points);
    }
    const Vec3 hip = hand.next(0.001);
    comparison.compare(scenes.around(hip, 0.06, hand), hip, parameters);
    ASSERT_FALSE(HasFatalFailure()) << i;
  }
  EXPECT_GT(comparison.touching(), 100);
}

TEST(SearchMemory, ForgetsFreeSpaceWhenTheSceneChanges) {
  const auto model = std::make_unique<DepthModel>(DepthModelParameters{}, PoseParameters{});
  GridParameters grid;
  grid.point_capacity = kCapacity;
  BuiltScene built(*model, grid);
  SearchMemory memory(kCapacity);
  const test::FramePointer nothing = test::frameOf(drivers::kKinectNoMeasurement);
  const test::FramePointer wall = test::frameOf(760);  // 1.004 m
  // One measurement far from the HIP, so that there is something to search.
  nothing->raw[0] = 760;
  const Vec3 hip{0, 0, -1};
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(nearestSprings(built.build(*nothing, hip), hip, {}, memory).points_used, 0U);
    EXPECT_EQ(nearestSprings(built.scene, hip, {}, memory).points_used, 0U);
    EXPECT_EQ(nearestSprings(built.build(*wall, hip), hip, {}, memory).points_used, 100U);
  }
}

TEST(SearchMemory, FindsTheWallWhenTheHandLeavesFreeSpace) {
  const auto model = std::make_unique<DepthModel>(DepthModelParameters{}, PoseParameters{});
  BuiltScene built(*model, GridParameters{});
  built.build(*test::frameOf(760), {0, 0, -0.95});
  const double wall_z = -1 / (760 * -0.003071102 + 3.330949516);
  const SpringParameters parameters{500, 0.04, 1, 100};
  // Moves inwards in steps of 0.1 mm, starting where the remembered free space ends in front of the wall,
  // just in front of it, or would extend beyond: the first force occurs when the nearest of the points, 1.7
  // mm apart, is within 40 mm, at a height between sqrt(40^2 - 1.2^2) = 39.98 and 40 mm.
  for (const double start_m : {0.0402, 0.0450, 0.0499, 0.0501, 0.0503, 0.0510, 0.0600}) {
    SearchMemory memory(65536);
    double first_contact_m = 0;
    for (double h = start_m; h > 0.03 && first_contact_m == 0; h -= 0.0001) {
      const Vec3 hip{0.0002, 0.0003, wall_z + h};
      if (nearestSprings(built.scene, hip, parameters, memory).points_used != 0) first_contact_m = h;
    }
    EXPECT_LE(first_contact_m, 0.04) << start_m;
    EXPECT_GE(first_contact_m, 0.03998 - 0.0001) << start_m;
  }
}

}  // namespace
}  // namespace hapticd::rt
