// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/handle/falcon/falcon_arm.h"

namespace hapticd::drivers {
namespace {

std::string text(const FalconFrame& frame) {
  return {frame.begin(), frame.end()};
}

std::optional<FalconReply> parsed(std::string_view bytes) {
  FalconFrame frame{};
  EXPECT_EQ(bytes.size(), frame.size());
  std::copy(bytes.begin(), bytes.end(), frame.begin());
  return replyIn(frame);
}

std::vector<FalconReply> repliesIn(FalconReplyStream& stream, std::string_view bytes) {
  std::vector<FalconReply> replies;
  for (const char byte : bytes) {
    if (const auto reply = stream.add(static_cast<std::uint8_t>(byte))) replies.push_back(*reply);
  }
  return replies;
}

TEST(FalconPacket, OrdersHaveTheNibblesOfEachMotorTheLeastFirst) {
  EXPECT_EQ(text(frameOf({})), "<AAAAAAAAAAAAAA>");
  // -1447 = 0xFA59; 4095 = 0x0FFF; 1 = 0x0001
  EXPECT_EQ(text(frameOf({{-1447, 4095, 1}, FalconLed::off, false})), "<JFKPPPPABAAAAA>");
}

TEST(FalconPacket, NoMotorGetsMoreThanItsLimit) {
  // beyond 16 bits the sign would change: 0x0FFF, 0xF001
  EXPECT_EQ(text(frameOf({{40000, -40000, 0}, FalconLed::off, false})), "<PPPABAAPAAAAAA>");
}

TEST(FalconPacket, RepliesNameEncodersButtonsAndHoming) {
  const auto reply = parsed(
      "<JFKPPPPHAAAI\x76"
      "A>");
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->encoder_counts, (FalconCounts{-1447, 32767, -32768}));
  EXPECT_EQ(reply->buttons, 0x5);
  EXPECT_EQ(reply->homed, 0x3);
}

TEST(FalconPacket, ADamagedReplyIsNone) {
  const std::string good = "<JFKPAAAAAAAAAA>";
  ASSERT_TRUE(parsed(good));
  for (std::size_t i = 0; i < good.size(); ++i) {
    for (const int byte : {0x00, 0x40, 0x51, 0xFF, int{'<'}, int{'>'}}) {
      std::string damaged = good;
      damaged[i] = static_cast<char>(byte);
      if (damaged == good || i == 13 || i == 14) continue;
      EXPECT_FALSE(parsed(damaged)) << i << " " << byte;
    }
  }
}

TEST(FalconReplyStream, FindsRepliesBetweenNoise) {
  FalconReplyStream stream;
  const std::string reply = "<JFKPAAAAAAAAAA>";
  EXPECT_EQ(repliesIn(stream, reply + reply).size(), 2U);
  EXPECT_EQ(stream.damaged(), 0U);
  EXPECT_EQ(repliesIn(stream, "noise" + reply + "\x01>>AAAA" + reply).size(), 2U);
  EXPECT_EQ(stream.damaged(), 2U);
}

TEST(FalconReplyStream, LosesOnlyTheBrokenReplyWhereverItBreaks) {
  const std::string broken = "<BBBBBBBBBBBBAA>";
  const std::string whole = "<JFKPAAAAAAAAAA>";
  for (std::size_t length = 1; length < broken.size(); ++length) {
    FalconReplyStream stream;
    const auto replies = repliesIn(stream, broken.substr(0, length) + whole + whole);
    // 13 to 15 bytes may continue with the next '<', but then end wrongly
    ASSERT_EQ(replies.size(), 2U) << length;
    EXPECT_EQ(replies[0].encoder_counts, (FalconCounts{-1447, 0, 0})) << length;
    EXPECT_EQ(stream.damaged(), 1U) << length;
  }
}

TEST(FalconReplyStream, DoesNotJoinHalvesAcrossAReset) {
  FalconReplyStream stream;
  const std::string reply = "<JFKPAAAAAAAAAA>";
  EXPECT_TRUE(repliesIn(stream, reply.substr(0, 9)).empty());
  stream.reset();
  EXPECT_TRUE(repliesIn(stream, reply.substr(9)).empty());
  EXPECT_EQ(repliesIn(stream, reply).size(), 1U);
}

TEST(RemoveStatusBytes, TakesTwoFromEachPacketOf64) {
  for (const std::size_t length : {0U, 1U, 2U, 3U, 18U, 63U, 64U, 65U, 66U, 67U, 128U, 200U, 512U}) {
    std::vector<std::uint8_t> transfer;
    std::vector<std::uint8_t> carried;
    for (std::size_t i = 0; i < length; ++i) {
      transfer.push_back(static_cast<std::uint8_t>(i));
      if (i % 64 >= 2) carried.push_back(static_cast<std::uint8_t>(i));
    }
    transfer.resize(removeStatusBytes(transfer));
    EXPECT_EQ(transfer, carried) << length;
  }
}

using rt::Vec3;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Calls `check` for points all over the workspace: up to 50 mm from the axis, z from 85 to 165 mm. Farther
/// out the legs stretch.
void forWorkspace(const std::function<void(const Vec3&)>& check) {
  for (double x = -0.045; x < 0.046; x += 0.015) {
    for (double y = -0.045; y < 0.046; y += 0.015) {
      if (std::hypot(x, y) > 0.05) continue;
      for (double z = 0.085; z < 0.166; z += 0.01) check({x, y, z});
    }
  }
}

FalconAngles anglesOf(const FalconPose& pose) {
  return {pose.legs[0].thigh_rad, pose.legs[1].thigh_rad, pose.legs[2].thigh_rad};
}

TEST(FalconKinematics, FindsThePositionsThatWereComputedElsewhereForCounts) {
  struct Vector {
    FalconCounts counts;
    Vec3 position_m;
  };
  const Vector vectors[] = {{{0, 0, 0}, {0, 0, 0.134602}},
                            {{-200, -200, -200}, {0, 0, 0.125005}},
                            {{336, 336, 336}, {0, 0, 0.149999}},
                            {{500, -300, 100}, {0.020613, -0.021809, 0.135115}},
                            {{-53, -496, 70}, {0.020017, 0.000026, 0.124995}}};
  for (const auto& [counts, expected] : vectors) {
    const auto pose = falconPoseOf(thighAnglesOf(counts), kFalconCentre_m);
    ASSERT_TRUE(pose);
    // the vectors are rounded to micrometres
    EXPECT_NEAR(pose->position_m.x, expected.x, 0.6e-6);
    EXPECT_NEAR(pose->position_m.y, expected.y, 0.6e-6);
    EXPECT_NEAR(pose->position_m.z, expected.z, 0.6e-6);
  }
}

TEST(FalconKinematics, LegsReachFromTheBaseToTheGrip) {
  const double azimuths_deg[] = {105, -15, -135};
  forWorkspace([&](const Vec3& p) {
    const auto pose = falconPoseAt(p);
    ASSERT_TRUE(pose) << p.x << " " << p.y << " " << p.z;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [t1, t2, t3] = pose->legs[k];
      const double phi = azimuths_deg[k] * kDegree;
      const double reach = 0.01125 + 0.01125 + 0.1025 * std::sin(t3);
      // rounding of a few operations on numbers of 0.1 m
      EXPECT_NEAR(p.x * std::cos(phi) + p.y * std::sin(phi) - 0.04,
                  0.06 * std::cos(t1) - 0.01443 + reach * std::cos(t2), 1e-15);
      EXPECT_NEAR(-p.x * std::sin(phi) + p.y * std::cos(phi) + 0.02309, 0.1025 * std::cos(t3) + 0.025, 1e-15);
      EXPECT_NEAR(p.z, 0.06 * std::sin(t1) + reach * std::sin(t2), 1e-15);
    }
  });
}

TEST(FalconKinematics, FindsBackEveryPositionOfTheWorkspaceFromItsAngles) {
  forWorkspace([](const Vec3& p) {
    const auto there = falconPoseAt(p);
    ASSERT_TRUE(there);
    for (const Vec3& start : {kFalconCentre_m, p + Vec3{0.002, -0.001, 0.002}}) {
      const auto found = falconPoseOf(anglesOf(*there), start);
      ASSERT_TRUE(found) << p.x << " " << p.y << " " << p.z;
      // 1e-10 rad of an angle that changes by at least 2 rad/m along the position
      EXPECT_LT(norm(found->position_m - p), 5e-11) << p.x << " " << p.y << " " << p.z;
    }
  });
}

TEST(FalconKinematics, RefusesWhatTheLegsCannotReach) {
  for (const Vec3& p :
       {Vec3{0, 0, 0.3}, Vec3{0, 0, -0.12}, Vec3{0, 0, 0}, Vec3{0.3, 0, 0.125}, Vec3{0, -0.2, 0.1},
        Vec3{kNan, 0, 0.1}, Vec3{0, kInfinity, 0.1}, Vec3{0, 0, -kInfinity}, Vec3{1e300, 1e300, 1e300}}) {
    EXPECT_FALSE(falconPoseAt(p)) << p.x << " " << p.y << " " << p.z;
  }
}

TEST(FalconKinematics, NoCountsGiveAPositionThatIsOutsideTheReachOrDoesNotExplainThem) {
  int found = 0;
  for (int a = -32768; a < 32768; a += 1311) {
    for (int b = -3000; b <= 3000; b += 250) {
      for (int c = -3000; c <= 3000; c += 250) {
        for (const FalconCounts& counts : {FalconCounts{a, b, c}, FalconCounts{a / 20, b / 2, c / 2}}) {
          const FalconAngles angles = thighAnglesOf(counts);
          const auto pose = falconPoseOf(angles, kFalconCentre_m);
          if (!pose) continue;
          ++found;
          ASSERT_LE(std::hypot(pose->position_m.x, pose->position_m.y), kFalconReachFromAxis_m);
          ASSERT_GE(pose->position_m.z, kFalconNearest_m);
          ASSERT_LE(pose->position_m.z, kFalconFarthest_m);
          const auto there = falconPoseAt(pose->position_m);
          ASSERT_TRUE(there);
          for (std::size_t k = 0; k < 3; ++k) ASSERT_NEAR(there->legs[k].thigh_rad, angles[k], 1e-7);
        }
      }
    }
  }
  EXPECT_GT(found, 100);
}

TEST(FalconKinematics, AnglesThatAreNotFiniteHaveNoPosition) {
  EXPECT_FALSE(falconPoseOf({kNan, 0.5, 0.5}, kFalconCentre_m));
  EXPECT_FALSE(falconPoseOf({0.5, kInfinity, 0.5}, kFalconCentre_m));
  EXPECT_FALSE(falconPoseOf({0.5, 0.5, 0.5}, {0, kNan, 0.1}));
}

TEST(FalconForces, AreTheCountsPerNewtonThatWereComputedElsewhere) {
  const auto pose = falconPoseAt({0, 0, 0.125});
  ASSERT_TRUE(pose);
  EXPECT_EQ(motorCountsFor(*pose, {0, 0, 1}, 1).motor_counts, (FalconCounts{-252, -252, -252}));
  EXPECT_EQ(motorCountsFor(*pose, {1, 0, 0}, 1).motor_counts, (FalconCounts{-179, 606, -427}));
  EXPECT_EQ(motorCountsFor(*pose, {0, 1, 0}, 1).motor_counts, (FalconCounts{596, -143, -453}));
  EXPECT_EQ(motorCountsFor(*pose, {0, 0, 1}, 0.25).motor_counts, (FalconCounts{-63, -63, -63}));
}

TEST(FalconForces, DoTheWorkOfTheForceAtTheGrip) {
  // virtual work: torque . d theta = force . d position, for any small motion
  forWorkspace([](const Vec3& p) {
    const auto pose = falconPoseAt(p);
    ASSERT_TRUE(pose);
    const Vec3 force_n{1.5, -0.7, 2.2};
    const auto torques = thighTorquesOf(*pose, force_n);
    for (const Vec3& motion_m : {Vec3{1e-6, 0, 0}, Vec3{0, 1e-6, 0}, Vec3{0, 0, 1e-6}}) {
      const auto before = falconPoseAt(p - motion_m);
      const auto after = falconPoseAt(p + motion_m);
      ASSERT_TRUE(before && after);
      double work_j = 0;
      for (std::size_t k = 0; k < 3; ++k)
        work_j += torques[k] * (after->legs[k].thigh_rad - before->legs[k].thigh_rad);
      // rounding of angles of 1 rad, and second order of the micrometre
      EXPECT_NEAR(work_j, 2 * dot(force_n, motion_m), 1e-13);
    }
  });
}

TEST(FalconForces, BeyondTheLimitKeepTheirDirection) {
  const auto pose = falconPoseAt({0, 0, 0.125});
  ASSERT_TRUE(pose);
  const FalconForce force = motorCountsFor(*pose, {100, 0, 0}, 1);
  EXPECT_EQ(force.motor_counts[1], 4095);
  // (-179, 606, -427) times 4095 / 606; the counts per newton are rounded to half a count
  EXPECT_NEAR(force.motor_counts[0], -179 * 4095 / 606.0, 0.5 * 4095 / 606 + 2);
  EXPECT_NEAR(force.motor_counts[2], -427 * 4095 / 606.0, 0.5 * 4095 / 606 + 4);
  EXPECT_NEAR(force.exerted_share, 4095 / 60600.0, 1e-4);
  EXPECT_EQ(motorCountsFor(*pose, {6, 0, 0}, 1).exerted_share, 1);
}

TEST(FalconForces, ThatAreNotFiniteAreNone) {
  const auto pose = falconPoseAt({0, 0, 0.125});
  ASSERT_TRUE(pose);
  for (const double bad : {kNan, kInfinity, -kInfinity, std::numeric_limits<double>::max()}) {
    for (const int counts : motorCountsFor(*pose, {1, bad, 1}, 1).motor_counts)
      EXPECT_LE(std::abs(counts), 4095);
  }
  EXPECT_EQ(motorCountsFor(*pose, {kNan, 0, 1}, 1).motor_counts, FalconCounts{});
}

}  // namespace
}  // namespace hapticd::drivers
