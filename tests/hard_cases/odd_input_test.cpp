// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>

#include "drivers/camera/kinect_image.h"
#include "tests/hard_cases/hard_rig.h"

namespace hapticd::test {
namespace {

using rt::Vec3;

// The HIP at special positions: on a point, on the surface, on voxel boundaries, outside the grid, invalid.

constexpr std::uint16_t kRaw = 750;  // a wall about 0.97 m away

class Wall : public HardRig {
 public:
  explicit Wall(rt::ForceLaw law) : HardRig(law) { showConstant(kRaw); }
  double z() const { return -box.depthModel().depth_m(kRaw); }
  Vec3 inFront(double distance_m, double x_m = 0.0123, double y_m = 0.0071) const {
    return {x_m, y_m, z() + distance_m};
  }
};

/// Returns the largest change of the force that the law itself permits for a step of the HIP of this length:
/// k_s for the laws with a proxy; for the springs their steepest slope, k_s (2 D / a_N - 1), with the N_max
/// nearest points on a disc of radius a_N, plus a change of the N_max-th point, at most 2 k_s (D - s) /
/// N_max.
double largestStep_n(rt::ForceLaw law, double step_m) {
  const rt::SpringParameters springs;
  const double k = springs.stiffness_n_per_m;
  switch (law) {
    case rt::ForceLaw::nearest_springs: {
      constexpr double kDiscRadius_m = 0.0093;  // sqrt(100 / (pi 351205 / 0.973^2))
      return k * (2 * springs.radius_m / kDiscRadius_m - 1) * step_m +
             2 * k * springs.radius_m / springs.max_points;
    }
    case rt::ForceLaw::smooth_springs:
      // near a point the direction fades in over 1 mm: one of 600 points of mean weight 1/3 turns by 2 k D
      return (2 * k + 3 * 2 * k * springs.radius_m / 600 / 0.001) * step_m;
    case rt::ForceLaw::proxy:
    case rt::ForceLaw::surface:
      return 1.02 * k * step_m;
  }
  return 0;
}

TEST_P(EachLaw, IsFiniteAndSteadyWithTheHipExactlyOnAPoint) {
  Wall wall(GetParam());
  const std::uint32_t pixel = rt::PackedPixel::pack(347, 238, kRaw);
  const Vec3 point = wall.box.depthModel().pointInWorld(pixel);
  wall.jumpTo(point + Vec3{0, 0, 0.03});
  const rt::Tick on_point = wall.moveTo(point);
  ASSERT_TRUE(isFinite(on_point.law_force_n_in_world));
  for (const Vec3& direction : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}, Vec3{0, 0, -1}}) {
    const rt::Tick beside = wall.tick(point + 1e-12 * direction);
    // one of the N_max springs reverses its direction
    EXPECT_LE(norm(beside.law_force_n_in_world - on_point.law_force_n_in_world),
              largestStep_n(GetParam(), 1e-9) + 0.002);
  }
}

TEST_P(EachLaw, PassesTheSurfaceInMicrometresWithoutAJump) {
  Wall wall(GetParam());
  wall.jumpTo(wall.inFront(0.03));
  Vec3 before = wall.moveTo(wall.inFront(0.001)).law_force_n_in_world;
  constexpr double kStep_m = 1e-6;
  for (int step = 1; step <= 2000; ++step) {
    const Vec3 force = wall.tick(wall.inFront(0.001 - step * kStep_m)).law_force_n_in_world;
    ASSERT_LE(norm(force - before), largestStep_n(GetParam(), kStep_m) + 1e-9) << "step " << step;
    before = force;
  }
}

TEST_P(EachConstraint, NeverPullsOnEitherSideOfAWall) {
  Wall wall(GetParam());
  wall.jumpTo(wall.inFront(0.05));
  for (int step = 0; step <= 900; ++step) {
    const double distance = 0.05 - step * 1e-4;
    const rt::Tick tick = wall.tick(wall.inFront(distance));
    ASSERT_GE(tick.law_force_n_in_world.z, 0) << distance;
    // no force in front of the surface; behind it within the mean rounding of facets and points (10 um)
    const double expected = std::max(0.0, -distance * wall.stiffness_n_per_m());
    ASSERT_NEAR(tick.law_force_n_in_world.z, expected, 0.02) << distance;
  }
}

TEST_P(EachLaw, CrossesVoxelBoundariesWithoutAJump) {
  for (const Vec3& direction : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0.6, 0.8, 0}}) {
    Wall wall(GetParam());
    wall.jumpTo(wall.inFront(0.03));
    wall.moveTo(wall.inFront(-0.01));
    const Vec3 start = wall.hip();
    Vec3 before = wall.tick(start).law_force_n_in_world;
    constexpr double kStep_m = 1e-5;
    for (int step = 1; step <= 4000; ++step) {  // four voxels
      const rt::Tick tick = wall.tick(start + (step * kStep_m) * direction);
      const double jump = norm(tick.law_force_n_in_world - before);
      // the rounding of the proxy's position on the surface is 1/1000 voxel; the mean of the points within r3
      // changes by the contribution of one of about 150 points that enters with weight zero
      const double rounding = rt::hasProxy(GetParam()) ? 0.03 : 0;
      ASSERT_LE(jump, largestStep_n(GetParam(), kStep_m) + rounding) << "step " << step;
      before = tick.law_force_n_in_world;
    }
  }
}

TEST_P(EachLaw, GivesNoForceAtInvalidPositionsAndRecovers) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Wall wall(GetParam());
  for (const double odd : {kNaN, kInfinity, -kInfinity, 1e300, -1e300, 1e18, 10.001, -1e9}) {
    for (int axis = 0; axis < 3; ++axis) {
      Vec3 hip = wall.inFront(0.02);
      (axis == 0 ? hip.x : axis == 1 ? hip.y : hip.z) = odd;
      rt::Tick tick;
      for (int i = 0; i < rt::SafetyChain::kReleaseTicks; ++i) tick = wall.tick(hip);
      EXPECT_EQ(tick.command_force_n_in_world, Vec3{}) << odd;
      EXPECT_TRUE(isFinite(wall.box.lawForce(hip).force_n_in_world)) << odd;
      wall.jumpTo(wall.inFront(0.05));
      const rt::Tick back = wall.moveTo(wall.inFront(0.015));
      EXPECT_TRUE(isFinite(back.command_force_n_in_world));
      EXPECT_EQ(back.mode, rt::Mode::engaged);
    }
  }
}

TEST_P(EachLaw, TreatsDenormalCoordinatesAsZero) {
  const double denormal = std::numeric_limits<double>::denorm_min();
  Wall wall(GetParam());
  wall.jumpTo(wall.inFront(0.03, 0, 0));
  const rt::Tick zero = wall.moveTo(wall.inFront(-0.005, 0, 0));
  const rt::Tick tick = wall.tick(wall.inFront(-0.005, denormal, -denormal));
  EXPECT_LE(norm(tick.law_force_n_in_world - zero.law_force_n_in_world), 1e-3);
}

TEST_P(EachLaw, GivesNoForceOutsideTheCamerasView) {
  Wall wall(GetParam());
  for (const Vec3& hip :
       {Vec3{0, 0, 5}, Vec3{5, 5, -0.5}, Vec3{0, 0, -9.9}, Vec3{0, 0, 0}, Vec3{9.9, -9.9, 9.9}}) {
    EXPECT_EQ(wall.tick(hip).law_force_n_in_world, Vec3{});
  }
}

// Frames with few, no, or too many measurements.

TEST_P(EachLaw, FramesWithoutMeasurementsGiveNoForce) {
  // 1084 and 1085 are on both sides of the pole of 1 / (a d + b), 2047 is no measurement, the others are
  // damaged
  for (const int damaged : {1084, 1085, 2046, 2047, 2048, 65535, 0}) {
    HardRig rig(GetParam());
    rig.showConstant(static_cast<std::uint16_t>(damaged));
    for (const Vec3& hip : {Vec3{0, 0, -1}, Vec3{0, 0, 0.338}, Vec3{0, 0, -0.3}, Vec3{0.1, 0.1, -3.9}}) {
      const rt::Tick tick = rig.tick(hip);
      EXPECT_EQ(tick.law_force_n_in_world, Vec3{}) << damaged;
      EXPECT_EQ(tick.contact, rt::ContactState::free) << damaged;
    }
  }
}

/// Presses from 20 mm in front of the wall that the pixels selected by `shown` lie on to 20 mm behind it.
void expectBoundedForces(HardRig& rig, const std::function<bool(int, int)>& shown) {
  rig.show([&](rt::DepthFrame& frame) {
    for (int row = 0; row < drivers::kKinectHeight; ++row) {
      for (int column = 0; column < drivers::kKinectWidth; ++column) {
        frame.raw[row * drivers::kKinectWidth + column] =
            shown(row, column) ? kRaw : drivers::kKinectNoMeasurement;
      }
    }
  });
  const Vec3 point = rig.box.depthModel().pointInWorld(rt::PackedPixel::pack(340, 243, kRaw));
  rig.jumpTo(point + Vec3{0, 0, 0.02});
  for (int step = 0; step <= 400; ++step) {
    const rt::Tick tick = rig.moveTo(point + Vec3{0, 0, 0.02 - step * 1e-4});
    ASSERT_TRUE(isFinite(tick.law_force_n_in_world)) << "step " << step;
    // no spring is longer than D_thresh; a proxy stays where the HIP came from
    const double longest_m = rt::hasProxy(rig.box.parameters().law) ? 0.041 + 0.02 : 0.04;
    ASSERT_LE(norm(tick.law_force_n_in_world), rig.stiffness_n_per_m() * longest_m) << "step " << step;
  }
}

TEST_P(EachLaw, ASinglePointIsHarmless) {
  HardRig rig(GetParam());
  expectBoundedForces(rig, [](int row, int column) { return row == 243 && column == 340; });
}

TEST_P(EachLaw, PointsOnALineAreHarmless) {
  HardRig rig(GetParam());
  expectBoundedForces(rig, [](int row, int) { return row == 243; });
  HardRig upright(GetParam());
  expectBoundedForces(upright, [](int, int column) { return column == 340; });
  HardRig diagonal(GetParam());
  expectBoundedForces(diagonal, [](int row, int column) { return row - 243 == column - 340; });
}

TEST_P(EachLaw, ACheckerboardOfMeasurementsIsHarmless) {
  HardRig rig(GetParam());
  expectBoundedForces(rig, [](int row, int column) { return (row + column) % 2 == 0; });
}

TEST_P(EachLaw, FewPointsGiveNoMoreForceThanTheMinimumCountAllows) {
  // N crosses N_min and N_max as blocks of 1 x 1 to 14 x 14 pixels are shown
  for (int size = 1; size <= 14; ++size) {
    HardRig rig(GetParam());
    expectBoundedForces(rig, [size](int row, int column) {
      return row >= 243 && row < 243 + size && column >= 340 && column < 340 + size;
    });
  }
}

TEST(HardCase, SmoothSpringsAreContinuousInTheNumberOfPoints) {
  double before = 0;
  for (int points = 0; points <= 60; ++points) {
    HardRig rig(rt::ForceLaw::smooth_springs);
    rig.show([points](rt::DepthFrame& frame) {
      std::fill_n(frame.raw, drivers::kKinectPixels, drivers::kKinectNoMeasurement);
      for (int i = 0; i < points; ++i) frame.raw[(240 + i / 8) * drivers::kKinectWidth + 336 + i % 8] = kRaw;
    });
    const Vec3 point = rig.box.depthModel().pointInWorld(rt::PackedPixel::pack(340, 243, kRaw));
    const double force = norm(rig.tick(point + Vec3{0, 0, 0.02}).law_force_n_in_world);
    // one point of weight w <= 1/2 contributes at most k w (D - s) / (N_min / 3)
    EXPECT_LE(std::abs(force - before), 500 * 0.5 * 0.02 * 3 / 10 + 1e-9) << points;
    before = force;
  }
}

TEST_P(EachLaw, AllPixelsWithinOneBallAreBounded) {
  // a camera with a narrow field of view: all 307,200 points lie within 3 cm
  rt::DepthModelParameters narrow;
  narrow.fx_px = 20000;
  narrow.fy_px = 20000;
  HardRig rig(GetParam(), narrow);
  rig.showConstant(kRaw);
  const double z = -rig.box.depthModel().depth_m(kRaw);
  rig.jumpTo({0, 0, z + 0.02});
  for (int step = 0; step <= 40; ++step) {
    const rt::Tick tick = rig.moveTo({0, 0, z + 0.02 - step * 1e-3});
    ASSERT_TRUE(isFinite(tick.law_force_n_in_world));
    ASSERT_LE(norm(tick.law_force_n_in_world), 20.5);
  }
  EXPECT_LE(rig.box.scene().points, static_cast<std::uint32_t>(rt::GridParameters{}.point_capacity));
}

TEST_P(EachLaw, AWallRightInFrontOfTheCameraIsBounded) {
  HardRig rig(GetParam());
  rig.showConstant(318);  // 0.425 m: 11,000 points in the ball of radius D_thresh
  const double z = -rig.box.depthModel().depth_m(318);
  ASSERT_LT(z, -0.4);
  rig.jumpTo({0, 0, z + 0.02});
  const rt::Tick tick = rig.moveTo({0, 0, z + 0.01});
  EXPECT_TRUE(isFinite(tick.law_force_n_in_world));
  EXPECT_LE(norm(tick.law_force_n_in_world), 20);
}

}  // namespace
}  // namespace hapticd::test
