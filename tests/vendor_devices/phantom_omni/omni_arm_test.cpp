// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "tests/vendor_devices/phantom_omni/emulated_omni.h"
#include "tools/haptic-bridge/phantom_omni/arm.h"
#include "tools/haptic-bridge/phantom_omni/link.h"

// The arm and the packets of a Phantom Omni.
namespace hapticd::test {
namespace {

namespace omni = tools::phantom_omni;

constexpr double kRadPerCount = 2 * std::numbers::pi / 15000;

omni::JointAngles randomAngles(std::mt19937& random) {
  std::uniform_real_distribution<double> angle(-std::numbers::pi, std::numbers::pi);
  return {angle(random), angle(random), angle(random)};
}

TEST(OmniArm, HasItsWristWhereTwoLinksInAFrameOfTheirOwnEnd) {
  std::mt19937 random(1);
  const rt::Vec3 origin_m = OmniModel::wristAt({}) - omni::wristAt({});
  for (int round = 0; round < 200; ++round) {
    const omni::JointAngles angles_rad = randomAngles(random);
    EXPECT_LT(norm(omni::wristAt(angles_rad) - (OmniModel::wristAt(angles_rad) - origin_m)), 1e-12);
  }
}

TEST(OmniArm, MovesToTheRightUpAndTowardsThePersonForPositiveAngles) {
  const rt::Vec3 middle_m = omni::wristAt({0, 0.3, 0.3});
  EXPECT_GT(omni::wristAt({0.1, 0.3, 0.3}).x, middle_m.x);
  EXPECT_GT(omni::wristAt({0, 0.4, 0.3}).y, middle_m.y);
  EXPECT_GT(omni::wristAt({0, 0.3, 0.4}).z, middle_m.z);
  EXPECT_LT(norm(middle_m), 0.15) << "the origin is near the middle of the workspace";
}

TEST(OmniArm, HasTheJacobianOfItsWrist) {
  std::mt19937 random(2);
  constexpr double kStep_rad = 1e-5;
  constexpr double kTruncation_m = 1e-9;  // its cube times the reach, and rounding divided by it
  for (int round = 0; round < 200; ++round) {
    const omni::JointAngles angles_rad = randomAngles(random);
    const auto jacobian = omni::jacobianAt(angles_rad);
    for (std::size_t joint = 0; joint < 3; ++joint) {
      omni::JointAngles more = angles_rad;
      omni::JointAngles less = angles_rad;
      more[joint] += kStep_rad;
      less[joint] -= kStep_rad;
      const rt::Vec3 difference = 0.5 / kStep_rad * (omni::wristAt(more) - omni::wristAt(less));
      EXPECT_LT(norm(jacobian[joint] - difference), kTruncation_m) << round << " " << joint;
    }
  }
}

TEST(OmniArm, ExertsAForceByTorquesThatDoTheSameWork) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> component(-3, 3);
  for (int round = 0; round < 200; ++round) {
    const OmniJoints pose_rad = randomOmniPose(random);
    const rt::Vec3 force_n{component(random), component(random), component(random)};
    const auto torques_n_m = omni::jointTorques(pose_rad, force_n);
    constexpr double kDifferences = 1e-6;  // of the model's levers
    EXPECT_LT(norm(OmniModel::forceOf(pose_rad, torques_n_m) - force_n), kDifferences) << round;
  }
}

TEST(OmniArm, ShortensAForceThatItsMotorsCannotExertInItsDirection) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> component(-30, 30);
  for (int round = 0; round < 200; ++round) {
    const OmniJoints pose_rad = randomOmniPose(random);
    const OmniJoints gains = randomOmniGains(random);
    const rt::Vec3 force_n{component(random), component(random), component(random)};
    const omni::OmniCommand command = omni::commandFor(pose_rad, gains, force_n);
    OmniJoints torques_n_m{};
    for (std::size_t joint = 0; joint < 3; ++joint) {
      EXPECT_LE(std::abs(command.counts[joint]), omni::kMostCounts);
      torques_n_m[joint] = command.counts[joint] * gains[joint];
    }
    const rt::Vec3 exerted_n = OmniModel::forceOf(pose_rad, torques_n_m);
    constexpr double kRounded_n = 0.03;  // half a count of three motors
    EXPECT_LT(norm(cross(exerted_n, 1 / norm(force_n) * force_n)), kRounded_n) << round;
    EXPECT_LT(dot(exerted_n, force_n) / norm(force_n), norm(force_n) + kRounded_n);
    EXPECT_TRUE(command.motors_on);
  }
}

omni::OmniReading readingOf(const std::array<int, 3>& encoders, bool docked) {
  omni::OmniReading reading;
  for (std::size_t joint = 0; joint < 3; ++joint)
    reading.encoders[joint] = static_cast<std::int16_t>(encoders[joint]);
  reading.docked = docked;
  return reading;
}

TEST(OmniHoming, GivesAnglesFromTheDockedPoseOnWhereverTheEncodersBegin) {
  std::mt19937 random(5);
  std::uniform_int_distribution<int> anywhere(-32768, 32767);
  std::uniform_int_distribution<int> turned(-4000, 4000);
  for (int round = 0; round < 200; ++round) {
    const std::array<int, 3> docked{anywhere(random), anywhere(random), anywhere(random)};
    const std::array<int, 3> moved{turned(random), turned(random), turned(random)};
    omni::Homing homing;
    EXPECT_FALSE(homing.anglesAt(readingOf(docked, true), 0));
    ASSERT_TRUE(homing.anglesAt(readingOf(docked, true), omni::Homing::kStill_ns));
    const auto angles_rad =
        homing.anglesAt(readingOf({docked[0] + moved[0], docked[1] + moved[1], docked[2] + moved[2]}, false),
                        omni::Homing::kStill_ns);
    ASSERT_TRUE(angles_rad);
    constexpr std::array<int, 3> kSigns{1, -1, 1};
    for (std::size_t joint = 0; joint < 3; ++joint)
      EXPECT_NEAR((*angles_rad)[joint], kOmniDocked_rad[joint] + kSigns[joint] * moved[joint] * kRadPerCount,
                  1e-9);
  }
}

TEST(OmniHoming, WaitsUntilTheArmIsStillInItsDock) {
  omni::Homing homing;
  std::int64_t now_ns = 0;
  for (int step = 0; step < 1000; ++step) {
    now_ns += 10'000'000;
    EXPECT_FALSE(homing.anglesAt(readingOf({20 * step, 0, 0}, true), now_ns)) << "it moves";
  }
  for (int step = 0; step < 1000; ++step) {
    now_ns += 10'000'000;
    EXPECT_FALSE(homing.anglesAt(readingOf({0, 0, 0}, step % 10 != 0), now_ns)) << "it was taken out";
  }
}

TEST(OmniPackets, OfNoOmniAreNotTakenForReadings) {
  std::array<unsigned char, omni::kMostReadingBytes> bytes{};
  bytes[2] = 0x1e;
  EXPECT_TRUE(omni::readingIn(bytes));
  EXPECT_TRUE(omni::readingIn(std::span(bytes).first(omni::kReadingBytes)));
  EXPECT_FALSE(omni::readingIn(std::span(bytes).first(omni::kReadingBytes - 1)));
  EXPECT_FALSE(omni::readingIn({}));
  for (std::size_t at = 0; at < 4; ++at) {
    auto wrong = bytes;
    wrong[at] ^= 1;
    EXPECT_FALSE(omni::readingIn(wrong)) << at;
  }
}

TEST(OmniPackets, HaveNoTorqueWhileTheMotorsAreOff) {
  const auto off = omni::bytesOf({.counts = {100, -100, 5000}, .motors_on = false});
  const std::array<unsigned char, omni::kCommandBytes> expected{0xff, 0x07, 0xff, 0x07,
                                                                0xff, 0x07, 0xc0, 0x53};
  EXPECT_EQ(off, expected);
}

TEST(OmniPackets, CutCountsToWhatTheConvertersTake) {
  const auto bytes = omni::bytesOf(
      {.counts = {100000, -100000, -1}, .motors_on = true, .light = omni::DockLight::fast_flash});
  const std::array<unsigned char, omni::kCommandBytes> expected{0xfe, 0x0f, 0x00, 0x00,
                                                                0xfe, 0x07, 0xca, 0x53};
  EXPECT_EQ(bytes, expected);
}

TEST(OmniSerial, IsPrintedByItsFields) {
  EXPECT_EQ(omni::serialText(0x80000001 | 4U << 23 | 10U << 19 | 23U << 14 | 1U << 11 | 321U << 1),
            "41023100321");
}

}  // namespace
}  // namespace hapticd::test
