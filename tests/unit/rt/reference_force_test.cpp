// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "rt/laws/nearest_springs.h"
#include "tests/unit/rt/scene/made_up_scene.h"
#include "tests/unit/rt/simd_targets.h"

namespace hapticd::rt {
namespace {

using test::BuiltScene;
using test::FramePointer;
using test::wholeFrameGrid;
using tools::PointCloud;
using tools::ReferenceCamera;
using tools::SpringOracle;

/// Two walls with a step of 0.3 m between them and holes: depth discontinuities and borders.
FramePointer steppedFrame() {
  return test::frameOf([](int u, int v) -> std::uint16_t {
    if ((u / 40 + v / 40) % 5 == 0) return drivers::kKinectNoMeasurement;
    return static_cast<std::uint16_t>((u < 320 ? 750 : 860) + (v > 240 ? 3 : 0));
  });
}

/// Few and isolated measurements, so that fewer than N_min and fewer than N_max points are common.
FramePointer sparseFrame(std::uint32_t seed) {
  std::mt19937 random(seed);
  return test::frameOf([&random](int, int) -> std::uint16_t {
    return random() % 50 == 0 ? static_cast<std::uint16_t>(700 + random() % 20)
                              : drivers::kKinectNoMeasurement;
  });
}

/// Compares the law on a frame, modelled with both extents, with brute force over all points of the frame.
class Comparison {
 public:
  /// `largest_radius_m`: largest radius to be compared; the window is just large enough for it, so that
  /// searches reach its last voxels.
  Comparison(const DepthFrame& frame, const PoseParameters& pose, std::uint32_t seed,
             double largest_radius_m = 0.04)
      : frame_(frame),
        camera_(kCamera, pose),
        cloud_(camera_.pointsOf(frame.image())),
        model_(std::make_unique<DepthModel>(kCamera, pose)),
        reach_(*model_, tightGrid(largest_radius_m)),
        whole_(*model_, wholeFrameGrid()),
        reach_memory_(drivers::kKinectPixels),
        whole_memory_(drivers::kKinectPixels),
        random_(seed) {
    whole_.build(frame);
  }

  double between(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }

  /// Returns a random position up to `reach_m` on each axis from a random point of the frame.
  Vec3 randomHip(double reach_m) {
    const Vec3 point = cloud_.points_m[random_() % cloud_.points_m.size()];
    return point + Vec3{between(-reach_m, reach_m), between(-reach_m, reach_m), between(-reach_m, reach_m)};
  }

  void compare(const Vec3& hip, const SpringParameters& parameters) {
    const Vec3 away{between(-0.01, 0.01), between(-0.01, 0.01), between(-0.01, 0.01)};
    reach_.build(frame_, hip + away, parameters.radius_m + kMaxAway_m);
    ASSERT_TRUE(reach_.scene.covers(hip, parameters.radius_m));
    const ForceSample by_reach = nearestSprings(reach_.scene, hip, parameters, reach_memory_);
    const ForceSample by_whole = nearestSprings(whole_.scene, hip, parameters, whole_memory_);
    const SpringOracle expected(cloud_.points_m, hip, parameters);
    const bool undecided = test::isUndecided(expected);
    touching_ += expected.pointsUsed() != 0 ? 1 : 0;
    undecided_ += undecided ? 1 : 0;
    if (undecided) return;
    ASSERT_EQ(by_reach.points_used, expected.pointsUsed());
    ASSERT_EQ(by_whole.points_used, expected.pointsUsed());
    const double error_n = norm(by_whole.force_n_in_world - expected.force_n());
    ASSERT_LE(error_n, test::roundingTolerance_n(parameters));
    // The same points in another order: at most 1000 roundings of at most k D, 2^-53 each.
    const double largest_n = parameters.stiffness_n_per_m * parameters.radius_m;
    ASSERT_LE(norm(by_reach.force_n_in_world - by_whole.force_n_in_world), 5e-14 * largest_n);
  }

  /// Returns the distance in metres from the HIP to the n-th nearest point; n = 1 for the nearest.
  double distanceOfRank(const Vec3& hip, std::size_t n) const {
    std::vector<double> distances;
    for (const Vec3& point : cloud_.points_m) distances.push_back(norm(hip - point));
    const auto nth = distances.begin() + static_cast<std::ptrdiff_t>(n - 1);
    std::nth_element(distances.begin(), nth, distances.end());
    return *nth;
  }
  int touching() const { return touching_; }
  int undecided() const { return undecided_; }

 private:
  static GridParameters tightGrid(double largest_radius_m) {
    GridParameters grid;
    grid.cells_per_axis = 8;
    grid.voxel_edge_m = (largest_radius_m + kMaxAway_m) / 3.49;  // the ball has 3.5 voxels minus rounding
    grid.point_capacity = drivers::kKinectPixels;
    return grid;
  }
  static constexpr double kMaxAway_m = 0.0174;  // corner of a cube of +-0.01
  static constexpr DepthModelParameters kCamera{};

  const DepthFrame& frame_;
  ReferenceCamera camera_;
  PointCloud cloud_;
  std::unique_ptr<DepthModel> model_;
  BuiltScene reach_, whole_;
  SearchMemory reach_memory_, whole_memory_;
  std::mt19937 random_;
  int touching_ = 0;
  int undecided_ = 0;
};

constexpr int kHips = 70;  // per frame, pose and SIMD target; some thousand in total

const PoseParameters kTurned{{0.3, -1.2, 2.5}, 0.3, -1.1, 2.4};

class AgainstBruteForce : public test::EachSimdTarget {};

TEST_P(AgainstBruteForce, IsThePapersLawOnSurfacesWithTheDefaultParameters) {
  for (const PoseParameters& pose : {PoseParameters{}, kTurned}) {
    for (const FramePointer& frame : {test::planeAndSphereFrame(1, {}), steppedFrame()}) {
      Comparison comparison(*frame, pose, 2);
      for (int i = 0; i < kHips; ++i) {
        comparison.compare(comparison.randomHip(i % 4 == 0 ? 0.001 : 0.03), {});
        if (HasFatalFailure()) return;
      }
      EXPECT_GT(comparison.touching(), kHips * 3 / 4);
      EXPECT_LT(comparison.undecided(), 3);
    }
  }
}

TEST_P(AgainstBruteForce, IsThePapersLawOnScatteredPoints) {
  for (const FramePointer& frame : {test::randomFrame(3, 271, 900), sparseFrame(4)}) {
    Comparison comparison(*frame, kTurned, 5);
    for (int i = 0; i < kHips; ++i) {
      comparison.compare(comparison.randomHip(0.03), {});
      if (HasFatalFailure()) return;
    }
    EXPECT_GT(comparison.touching(), kHips / 6);
    EXPECT_LT(comparison.undecided(), 3);
  }
}

TEST_P(AgainstBruteForce, IsThePapersLawForAllParameters) {
  for (const FramePointer& frame :
       {test::planeAndSphereFrame(6, {}), test::randomFrame(7, 271, 900), sparseFrame(8)}) {
    Comparison comparison(*frame, {}, 9, 0.1);
    for (int i = 0; i < kHips; ++i) {
      SpringParameters parameters;
      parameters.radius_m = comparison.between(0.005, 0.1);
      parameters.stiffness_n_per_m = comparison.between(20, 5000);
      parameters.max_points = i % 3 == 0 ? 1 + i % 7 : static_cast<int>(comparison.between(1, 1000.99));
      parameters.min_points = static_cast<int>(comparison.between(1, parameters.max_points + 0.99));
      comparison.compare(comparison.randomHip(parameters.radius_m), parameters);
      if (HasFatalFailure()) return;
    }
    EXPECT_GT(comparison.touching(), kHips / 4);
    EXPECT_LT(comparison.undecided(), 3);
  }
}

TEST_P(AgainstBruteForce, IsThePapersLawWhereAPointLiesCloserToALimitThanSinglePrecisionResolves) {
  const FramePointer frame = test::planeAndSphereFrame(10, {});
  Comparison comparison(*frame, kTurned, 11, 0.1);
  for (int i = 0; i < kHips / 3; ++i) {
    const Vec3 hip = comparison.randomHip(0.005);
    const double rank = comparison.distanceOfRank(hip, 60);
    for (const double off_m : {-1e-6, -1e-10, 1e-10, 1e-6}) {
      comparison.compare(hip, {500, rank + off_m, 60, 100});  // whether N_min is reached
      comparison.compare(hip, {500, rank + off_m, 1, 60});    // whether N_max is reached
      // The N_max-th point is at the first radius tried.
      comparison.compare(hip, {500, 3 * (rank + off_m), 1, 60});
      comparison.compare(hip, {500, 2 * (rank + off_m), 1, 60});  // and at the second
      if (HasFatalFailure()) return;
    }
  }
}

HAPTICD_FOR_EACH_SIMD_TARGET(AgainstBruteForce);

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

struct Setting {
  const char* name;
  DepthModelParameters model;
  PoseParameters pose;
};

Setting farAndWide() {
  Setting setting{"far and wide", {}, {{10, -10, 10}, 1, 2, 3}};
  setting.model.fx_px = setting.model.fy_px = 300;
  setting.model.far_m = 10;
  return setting;
}

const Setting kSettings[] = {
    {"identity", {}, {}},
    {"turned", {}, {{0.3, -1.2, 2.5}, 0.3, -1.1, 2.4}},
    {"turned otherwise", {}, {{-5, 4, -3}, -2.0, 0.7, -0.4}},
    farAndWide(),
};

/// Returns the largest distance between the grid's positions and those of eq. (1)-(2).
double largestError_m(const Scene& scene, const ReferenceCamera& camera) {
  double largest = 0;
  for (std::uint32_t i = 0; i < scene.points; ++i) {
    const GridPoint& p = scene.point[i];
    const Vec3 exact = camera.pointInWorld(PackedPixel::column(p.pixel), PackedPixel::row(p.pixel),
                                           PackedPixel::raw(p.pixel));
    largest = std::max(largest, norm(scene.origin_m_in_world + Vec3{p.x_m, p.y_m, p.z_m} - exact));
  }
  return largest;
}

class SinglePrecision : public test::EachSimdTarget {};

TEST_P(SinglePrecision, ErrsLessThanItsBoundWhereTheWholeFrameIsModelled) {
  for (const Setting& setting : kSettings) {
    SCOPED_TRACE(setting.name);
    const ReferenceCamera camera(setting.model, setting.pose);
    const auto model = std::make_unique<DepthModel>(setting.model, setting.pose);
    BuiltScene built(*model, wholeFrameGrid());
    const double largest = std::max(largestError_m(built.build(*test::randomFrame(1, 271, 1060)), camera),
                                    largestError_m(built.build(*test::frameOf(1003)), camera));
    EXPECT_LE(largest, model->singlePrecisionError_m());
    // A bound far above the true error would cost speed: every point closer than it to a limit is evaluated
    // twice.
    EXPECT_GE(largest, model->singlePrecisionError_m() / 50);
  }
}

TEST_P(SinglePrecision, ErrsLessThanItsBoundWhereOnlyTheReachIsModelled) {
  for (const Setting& setting : kSettings) {
    SCOPED_TRACE(setting.name);
    const ReferenceCamera camera(setting.model, setting.pose);
    const auto model = std::make_unique<DepthModel>(setting.model, setting.pose);
    BuiltScene built(*model, GridParameters{});
    const test::FramePointer frame = test::randomFrame(3, 271, 1060);
    std::uint32_t points = 0;
    for (std::uint32_t i = 0; i < 60; ++i) {
      const std::uint32_t raw = 271 + i * 12;
      const Vec3 centre = camera.pointInWorld(i * 37 % 640, i * 59 % 480, raw);
      const Scene& scene = built.build(*frame, centre);
      points += scene.points;
      ASSERT_LE(largestError_m(scene, camera), model->singlePrecisionError_m());
    }
    EXPECT_GT(points, 10000U);
  }
}

HAPTICD_FOR_EACH_SIMD_TARGET(SinglePrecision);

}  // namespace
}  // namespace hapticd::rt
