// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "tests/hard_cases/hard_rig.h"

#include "drivers/camera/kinect_image.h"

// Frames with few, no, or too many measurements.
namespace hapticd::test {
namespace {

using rt::Vec3;

constexpr std::uint16_t kRaw = 750;

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
