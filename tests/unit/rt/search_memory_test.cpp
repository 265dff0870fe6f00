// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "rt/laws/nearest_springs.h"
#include "tests/unit/rt/scene/built_scene.h"
#include "tests/unit/rt/scene/made_up_frame.h"

namespace hapticd::rt {
namespace {

using test::BuiltScene;

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
