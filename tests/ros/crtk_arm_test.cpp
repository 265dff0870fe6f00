// SPDX-License-Identifier: Apache-2.0
// What haptic-crtk-bridge makes of measurements and forces, without DDS.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tools/haptic-crtk-bridge/arm_measurement.h"

namespace hapticd::tools::crtk {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kNoon_ns = 1'700'000'000'000'000'000;

MeasuredPose poseAt(std::int64_t stamp_ns) {
  return {.frame = "base",
          .stamp_utc_ns = stamp_ns,
          .position_m = {0.1, 0.2, 0.3},
          .orientation = {},
          .publisher = 7};
}

TEST(PoseGate, AcceptsMeasurementsInTheOrderOfTheirStamps) {
  PoseGate gate("");
  for (int i = 1; i <= 10; ++i) EXPECT_EQ(gate.judge(poseAt(i * kMs)), PoseFault::none);
  EXPECT_EQ(gate.judge(poseAt(10 * kMs)), PoseFault::not_newer) << "the same again";
  EXPECT_EQ(gate.judge(poseAt(9 * kMs)), PoseFault::not_newer) << "overtaken";
  EXPECT_EQ(gate.rejected(PoseFault::not_newer), 2U);
  EXPECT_EQ(gate.judge(poseAt(11 * kMs)), PoseFault::none);
}

TEST(PoseGate, NamesAndCountsEachFault) {
  PoseGate gate("");
  ASSERT_EQ(gate.judge(poseAt(kMs)), PoseFault::none);
  MeasuredPose pose = poseAt(2 * kMs);
  pose.stamp_utc_ns = 0;
  EXPECT_EQ(gate.judge(pose), PoseFault::zero_stamp);
  for (const double wrong :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    pose = poseAt(2 * kMs);
    pose.position_m.z = wrong;
    EXPECT_EQ(gate.judge(pose), PoseFault::not_finite);
    pose = poseAt(2 * kMs);
    pose.orientation.w = wrong;
    EXPECT_EQ(gate.judge(pose), PoseFault::not_unit);
  }
  pose = poseAt(2 * kMs);
  pose.orientation = {0, 0, 0, 0};
  EXPECT_EQ(gate.judge(pose), PoseFault::not_unit);
  pose = poseAt(2 * kMs);
  pose.publisher = 8;
  EXPECT_EQ(gate.judge(pose), PoseFault::other_publisher);
  pose = poseAt(2 * kMs);
  pose.frame = "elsewhere";
  EXPECT_EQ(gate.judge(pose), PoseFault::other_frame);
  EXPECT_EQ(gate.rejected(PoseFault::not_unit), 3U);
  EXPECT_EQ(gate.rejected(PoseFault::not_finite), 2U);
  EXPECT_EQ(gate.judge(poseAt(2 * kMs)), PoseFault::none) << "what was rejected leaves no trace";
}

TEST(PoseGate, KeepsTheFrameOfTheFirstMeasurementOverAllSessions) {
  PoseGate gate("");
  ASSERT_EQ(gate.judge(poseAt(kMs)), PoseFault::none);
  gate.beginSession();
  MeasuredPose other = poseAt(2 * kMs);
  other.publisher = 8;
  EXPECT_EQ(gate.judge(other), PoseFault::none) << "another publisher";
  gate.beginSession();
  other.frame = "elsewhere";
  EXPECT_EQ(gate.judge(other), PoseFault::other_frame);
  PoseGate told("wanted");
  EXPECT_EQ(told.judge(poseAt(kMs)), PoseFault::other_frame);
}

/// The delay after many measurements with this period, which arrive that old.
ArmDelay delayOf(std::int64_t period_ns, std::int64_t age_ns) {
  ArmDelay delay;
  for (int i = 0; i < 300; ++i) {
    const std::int64_t stamp_ns = kNoon_ns + i * period_ns;
    delay.add(stamp_ns, stamp_ns + age_ns);
  }
  return delay;
}

TEST(ArmDelay, IsTheWayThereAndBackAndOneAndAHalfPeriods) {
  for (const std::int64_t period_ns : {kMs, 2 * kMs, 5 * kMs}) {
    for (const std::int64_t age_ns : {kMs / 5, 2 * kMs, 10 * kMs}) {
      const ArmDelay delay = delayOf(period_ns, age_ns);
      EXPECT_TRUE(delay.trustsStamps());
      EXPECT_EQ(delay.latency_ns(), 2 * age_ns + period_ns + period_ns / 2);
    }
  }
}

TEST(ArmDelay, AssumesTenMillisecondsEachWayWhereStampsAreNotOfThisClock) {
  for (const std::int64_t age_ns : {-3'600'000 * kMs, -kMs, 101 * kMs, 3'600'000 * kMs}) {
    const ArmDelay delay = delayOf(2 * kMs, age_ns);
    EXPECT_FALSE(delay.trustsStamps()) << age_ns;
    EXPECT_EQ(delay.latency_ns(), 2 * ArmDelay::kUnknownWay_ns + 3 * kMs) << age_ns;
  }
}

TEST(ArmDelay, TrustsStampsAgainOnlyAfterAHundredPlausibleOnes) {
  ArmDelay delay = delayOf(2 * kMs, kMs);
  std::int64_t stamp_ns = kNoon_ns + 600 * kMs;
  delay.add(stamp_ns, stamp_ns - 1);
  EXPECT_FALSE(delay.trustsStamps()) << "from the future";
  for (int i = 0; i < ArmDelay::kProven; ++i) {
    EXPECT_FALSE(delay.trustsStamps());
    stamp_ns += 2 * kMs;
    delay.add(stamp_ns, stamp_ns + kMs);
  }
  EXPECT_TRUE(delay.trustsStamps());
}

void expectNear(const rt::Vec3& a, const rt::Vec3& b) {
  EXPECT_LE(norm(a - b), 1e-12);
}

// The power of a wrench is that of the force at the tip, whatever the convention: a definition that shares
// nothing with the conversion.
TEST(WrenchConventions, GiveTheSamePowerForAnyMotionOfTheTip) {
  const rt::RigidPose tip{{0.3, -0.2, 0.15}, rt::normalised({0.3, -0.5, 0.1, 0.8})};
  const rt::Vec3 force_n{1, -2, 3};
  const rt::Vec3 v{0.1, 0.05, -0.2};  // of the tip, in the frame
  const rt::Vec3 w{0.7, -0.4, 1.1};   // of the tip, in the frame
  const double power_w = dot(force_n, v);
  const Wrench absolute = wrenchOf(WrenchConvention::body_absolute, force_n, tip);
  EXPECT_NEAR(dot(absolute.force_n, v) + dot(absolute.torque_n_m, w), power_w, 1e-12);
  expectNear(absolute.force_n, force_n);
  const Wrench body = wrenchOf(WrenchConvention::body, force_n, tip);
  const rt::Quaternion to_tip = inverse(tip.orientation);
  EXPECT_NEAR(dot(body.force_n, rotated(to_tip, v)) + dot(body.torque_n_m, rotated(to_tip, w)), power_w,
              1e-12);
  const Wrench spatial = wrenchOf(WrenchConvention::spatial, force_n, tip);
  const rt::Vec3 v_of_origin = v - cross(w, tip.position_m_in_world);
  EXPECT_NEAR(dot(spatial.force_n, v_of_origin) + dot(spatial.torque_n_m, w), power_w, 1e-12);
}

}  // namespace
}  // namespace hapticd::tools::crtk
