// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "tests/hard_cases/hard_rig.h"

#include "drivers/camera/kinect_image.h"

// Strokes of the law `proxy` over exact scenes: only friction may hold the proxy back, at any distance.
namespace hapticd::test {
namespace {

using rt::Vec3;
using tools::SceneKind;
using tools::TrueScene;
using tools::TrueSceneParameters;

/// The bound for a stroke without friction and noise.
constexpr double kMaxAlong_n = 0.2;
constexpr double kStep_m = 2e-4;  // 0.2 m/s

/// Returns a camera that also measures much nearer surfaces: next to an edge with nothing behind it, the end
/// of a surface then cannot be mistaken for a surface that is too near to be measured.
rt::DepthModelParameters cameraAt(double distance_m) {
  rt::DepthModelParameters camera = fineCameraFor(distance_m);
  camera.near_m = 0.5 * distance_m;
  return camera;
}

double pitch_m(double distance_m) {
  return distance_m / rt::DepthModelParameters{}.fy_px;
}

class AtDistance : public testing::TestWithParam<double> {
 protected:
  /// Moves from 30 mm above `surface` to `depth_m` below it.
  static void pressIn(HardRig& rig, const Vec3& surface, const Vec3& normal, double depth_m) {
    rig.jumpTo(surface + 0.03 * normal);
    rig.tick(rig.hip());
    rig.moveTo(surface - depth_m * normal, kStep_m);
  }
  /// Strokes by `displacement` and checks that contact is kept and no force acts along the stroke.
  static void stroke(HardRig& rig, const Vec3& displacement) {
    const Vec3 from = rig.hip();
    const double length = norm(displacement);
    const Vec3 direction = (1 / length) * displacement;
    const int steps = static_cast<int>(std::lround(length / kStep_m));
    for (int step = 1; step <= steps; ++step) {
      const rt::Tick tick = rig.moveTo(from + (step * kStep_m) * direction, kStep_m);
      ASSERT_EQ(tick.contact, rt::ContactState::contact) << "step " << step;
      ASSERT_LE(std::abs(dot(tick.law_force_n_in_world, direction)), kMaxAlong_n) << "step " << step;
    }
  }
};

TEST_P(AtDistance, FollowsTheHipAlongThinRods) {
  const double z = GetParam();
  for (const double diameter : {0.01, 0.02, 0.04}) {
    SCOPED_TRACE(diameter);
    TrueScene rod({.kind = SceneKind::cylinder, .distance_m = z, .radius_m = diameter / 2}, cameraAt(z));
    HardRig rig(rt::ForceLaw::proxy, rod.depthModel());
    rig.show(rod);
    const auto approach = rod.approach(0);
    const double depth = std::min(0.008, 0.4 * diameter);
    pressIn(rig, approach.surface_m_in_world + Vec3{0, -0.03, 0}, -approach.inward_in_world, depth);
    stroke(rig, {0, 0.06, 0});
  }
}

TEST_P(AtDistance, FollowsTheHipBesideAnEdge) {
  const double z = GetParam();
  for (const double beside_m : {0.003, 0.01, 0.02}) {
    SCOPED_TRACE(beside_m);
    TrueScene block({.kind = SceneKind::half_plane, .distance_m = z}, cameraAt(z));
    HardRig rig(rt::ForceLaw::proxy, block.depthModel());
    rig.show(block);
    pressIn(rig, {-beside_m, -0.03, -z}, {0, 0, 1}, 0.008);
    stroke(rig, {0, 0.06, 0});
    // the bound for flat surfaces: one just noticeable difference of the force
    EXPECT_NEAR(rig.tick(rig.hip()).law_force_n_in_world.z, 0.008 * rig.stiffness_n_per_m(), 0.28);
  }
}

TEST_P(AtDistance, FollowsTheHipAcrossASlantedPlane) {
  const double z = GetParam();
  constexpr double kTilt_rad = 0.5;
  TrueScene plane({.kind = SceneKind::plane, .distance_m = z, .tilt_rad = kTilt_rad}, cameraAt(z));
  HardRig rig(rt::ForceLaw::proxy, plane.depthModel());
  rig.show(plane);
  const Vec3 normal = plane.normal({0, 0, -z}, 0);
  pressIn(rig, {0, 0, -z}, normal, 0.008);
  const Vec3 up{0, normal.z, -normal.y};
  stroke(rig, 0.03 * up + Vec3{0.03, 0, 0});
}

TEST_P(AtDistance, IsReleasedWithinAPixelBeyondAnEdge) {
  const double z = GetParam();
  TrueScene block({.kind = SceneKind::half_plane, .distance_m = z}, cameraAt(z));
  HardRig rig(rt::ForceLaw::proxy, block.depthModel());
  rig.show(block);
  pressIn(rig, {-0.02, 0.001, -z}, {0, 0, 1}, 0.008);
  double ends_m = -1;
  for (double x = -0.02; x < 0.02; x += kStep_m) {
    const rt::Tick tick = rig.moveTo({x, 0.001, -z - 0.008}, kStep_m);
    if (tick.law_force_n_in_world != Vec3{}) ends_m = x;
  }
  EXPECT_GE(ends_m, -pitch_m(z));
  EXPECT_LE(ends_m, pitch_m(z) + kStep_m);
}

TEST_P(AtDistance, GivesNoForceInASolidEnteredFromItsUnseenSide) {
  const double z = GetParam();
  for (const double below_m : {0.005, 0.02, 0.05}) {
    TrueScene block({.kind = SceneKind::half_plane, .distance_m = z}, cameraAt(z));
    HardRig rig(rt::ForceLaw::proxy, block.depthModel());
    rig.show(block);
    rig.jumpTo({0.06, 0.001, -z - below_m});
    rig.tick(rig.hip());
    for (double x = 0.06; x > -0.06; x -= 0.0005) {
      const rt::Tick tick = rig.moveTo({x, 0.001, -z - below_m});
      ASSERT_EQ(tick.law_force_n_in_world, Vec3{}) << x;
      if (x < -pitch_m(z)) {
        ASSERT_EQ(tick.contact, rt::ContactState::behind) << x;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Metres, AtDistance, testing::Values(0.6, 1.0, 2.0, 3.0));

/// A wall at 1 m, and an arm with 100 mm between its back and the region of the HIP.
class PassingArm : public HardRig {
 public:
  PassingArm() : HardRig(rt::ForceLaw::proxy) { wall(); }
  void wall() { showConstant(kWall); }
  /// Covers the columns from `first` on.
  void arm(int first) {
    show([first](rt::DepthFrame& frame) {
      for (std::size_t i = 0; i < drivers::kKinectPixels; ++i) {
        const int column = static_cast<int>(i) % drivers::kKinectWidth;
        frame.raw[i] = column >= first && column < first + 60 ? kArm : kWall;
      }
    });
  }
  Vec3 atWall(double height_m) { return {0, 0, -box.depthModel().depth_m(kWall) + height_m}; }

 private:
  static constexpr std::uint16_t kWall = 759;  // 1 m
  static constexpr std::uint16_t kArm = 685;   // 0.81 m
};

TEST(ProxyBehindAnArm, GivesNoForceInFrontOfTheWall) {
  PassingArm rig;
  rig.jumpTo(rig.atWall(0.03));
  for (int frame = 0; frame < 60; ++frame) {
    if (frame < 10) {
      rig.wall();
    } else {
      rig.arm(10 * frame);
    }
    for (int i = 0; i < kTicksPerFrame; ++i) {
      ASSERT_EQ(rig.tick(rig.hip()).law_force_n_in_world, Vec3{}) << frame;
    }
  }
}

TEST(ProxyBehindAnArm, KeepsTheForceOfTheWallThatItPressesOn) {
  PassingArm rig;
  rig.jumpTo(rig.atWall(0.03));
  rig.tick(rig.hip());
  const double pressed = rig.moveTo(rig.atWall(-0.006)).law_force_n_in_world.z;
  ASSERT_NEAR(pressed, 3, 0.05);
  for (int frame = 0; frame < 50; ++frame) {
    rig.arm(20 * frame);
    for (int i = 0; i < kTicksPerFrame; ++i) {
      // the same points, hidden or not
      ASSERT_NEAR(rig.tick(rig.hip()).law_force_n_in_world.z, pressed, 1e-3) << frame;
    }
  }
}

TEST(ProxyBehindAnArm, RestsOnTheHiddenWall) {
  PassingArm rig;
  rig.jumpTo(rig.atWall(0.03));
  rig.tick(rig.hip());
  rig.arm(300);
  rig.tick(rig.hip());
  EXPECT_NEAR(rig.moveTo(rig.atWall(-0.006)).law_force_n_in_world.z, 3, 0.05);
}

TEST(ProxyOnASurface, IsHeldWhenItComesTooNearToBeMeasured) {
  HardRig rig(rt::ForceLaw::proxy);
  constexpr std::uint16_t kNear = 280;     // 0.405 m
  constexpr std::uint16_t kTooNear = 268;  // 0.399 m, while near_m is 0.4 m
  rig.showConstant(kNear);
  const double depth_m = rig.box.depthModel().depth_m(kNear);
  rig.jumpTo({0, 0, -depth_m + 0.03});
  rig.tick(rig.hip());
  const double pressed = rig.moveTo({0, 0, -depth_m - 0.006}).law_force_n_in_world.z;
  ASSERT_NEAR(pressed, 3, 0.05);
  rig.showConstant(kTooNear);
  for (int i = 0; i < 100; ++i) {
    ASSERT_NEAR(rig.tick(rig.hip()).law_force_n_in_world.z, pressed, 1e-3) << i;
  }
}

}  // namespace
}  // namespace hapticd::test
