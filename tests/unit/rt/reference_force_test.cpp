// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <random>
#include <vector>

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

}  // namespace
}  // namespace hapticd::rt
