// SPDX-License-Identifier: Apache-2.0
// Messages of Foxglove's schemas. tests/foxglove and tests/trace_reader decode them with readers that are not
// of this project; here the bytes are compared with ones written by hand.
#include "daemon/trace/foxglove/foxglove_messages.h"

#include <gtest/gtest.h>

#include <cstring>
#include <string>

#include "daemon/trace/foxglove/foxglove_scene.h"

namespace hapticd::trace::foxglove {
namespace {

double numberAt(const std::string& message, std::size_t offset) {
  double number = 0;
  std::memcpy(&number, message.data() + offset, sizeof number);
  return number;
}

std::string bytesOf(double number) {
  return {reinterpret_cast<const char*>(&number), sizeof number};
}

TEST(FoxgloveMessages, ALogIsTheBytesThatCdrPrescribes) {
  std::string message;
  encodeLog(1'000'000'002, LogLevel::warning, "box", "hi", message);
  constexpr char kExpected[] =
      "\0\1\0\0"                  // XCDR1, little-endian
      "\1\0\0\0\2\0\0\0"          // timestamp
      "\3\0\0\0"                  // level, three bytes of padding
      "\3\0\0\0hi\0\0"            // message, one byte of padding
      "\4\0\0\0box\0"             // name
      "\1\0\0\0\0\0\0\0\0\0\0\0"  // file, three bytes of padding, line
      ;
  EXPECT_EQ(message, std::string(kExpected, sizeof kExpected - 1));
}

TEST(FoxgloveMessages, NumbersOfEightBytesAreAlignedBehindTexts) {
  std::string message;
  encodeTransforms(0, std::vector<Transform>{{"w", "c", {1.5, 2, 3}, {}}}, message);
  // count 4, time 8, "w" 4 + 2 and 2 of padding, "c" 4 + 2: 26; the numbers begin at the next multiple of 8
  constexpr std::size_t kHead = 4, kNumbers = 32;
  EXPECT_EQ(message.size(), kHead + kNumbers + 7 * sizeof(double));
  EXPECT_EQ(numberAt(message, kHead + kNumbers), 1.5);
  EXPECT_EQ(numberAt(message, message.size() - sizeof(double)), 1);
}

TEST(FoxgloveMessages, TheSizeOfASphereIsItsDiameter) {
  std::string message;
  const std::vector<Entity> entities{{.id = "a", .spheres = {{{1, 2, 3}, 0.125, {}}}}};
  encodeScene(0, entities, message);
  EXPECT_NE(message.find(bytesOf(0.25) + bytesOf(0.25) + bytesOf(0.25)), std::string::npos);
  EXPECT_EQ(message.find(bytesOf(0.125)), std::string::npos);
}

TEST(FoxgloveMessages, AnArrowIsAsLongAsItsVectorAndItsXAxisPointsAlongIt) {
  std::string message;
  const rt::Vec3 to_tip{0, 0, 0.5};
  Entity entity{.id = "a"};
  Arrow& arrow = entity.arrows.emplace_back();
  arrow.tail_to_tip_m = to_tip;
  arrow.head_length_m = 0.125;
  const std::vector<Entity> entities{entity};
  encodeScene(0, entities, message);
  const rt::Quaternion rotation = rt::shortestRotation({1, 0, 0}, to_tip);
  const std::string expected = bytesOf(rotation.x) + bytesOf(rotation.y) + bytesOf(rotation.z) +
                               bytesOf(rotation.w) + bytesOf(0.375);  // the shaft
  EXPECT_NE(message.find(expected), std::string::npos);
}

TEST(FoxgloveMessages, EveryChannelHasASchema) {
  for (const ChannelName& channel : {kSceneChannel, kTransformsChannel, kReachCloudChannel, kCloudChannel,
                                     kImageChannel, kCalibrationChannel, kLogChannel}) {
    EXPECT_FALSE(schemaOf(channel.schema).empty()) << channel.topic;
  }
  EXPECT_TRUE(schemaOf("hapticd_msgs/msg/Tick").empty());
}

rt::Tick tickInContact() {
  rt::Tick tick;
  tick.law = rt::ForceLaw::surface;
  tick.hip_m_in_world = {0.1, 0.2, 0.3};
  tick.proxy_m_in_world = {0.1, 0.2, 0.35};
  tick.command_force_n_in_world = {0, 0, 2};
  return tick;
}

std::string sceneOf(const rt::Tick& tick) {
  SceneRadii radii;
  radii.set("force.radius_m", "0.0625");
  radii.set("contact.proxy_radius_m", "0.03125");
  radii.set("force.stiffness_n_per_m", "0.5");  // none of the radii
  std::string message;
  encodeScene(0, tick, radii, {{1, 2, 3}, 0.5}, message);
  return message;
}

bool hasSphere(const std::string& message, double radius_m) {
  const std::string diameter = bytesOf(2 * radius_m);
  return message.find(diameter + diameter + diameter) != std::string::npos;
}

TEST(FoxgloveScene, ShowsTheSpheresOfTheLawAtTheirRadii) {
  const std::string with_proxy = sceneOf(tickInContact());
  EXPECT_TRUE(hasSphere(with_proxy, 0.03125));
  EXPECT_FALSE(hasSphere(with_proxy, 0.0625));
  EXPECT_TRUE(hasSphere(with_proxy, 0.5));
  rt::Tick springs = tickInContact();
  springs.law = rt::ForceLaw::nearest_springs;
  EXPECT_TRUE(hasSphere(sceneOf(springs), 0.0625));
  EXPECT_FALSE(hasSphere(sceneOf(springs), 0.03125));
}

TEST(FoxgloveScene, ShowsNoArrowWithoutForceAndNothingThatIsNotFinite) {
  const std::string text = "2.00 N";
  EXPECT_NE(sceneOf(tickInContact()).find(text), std::string::npos);
  rt::Tick without = tickInContact();
  without.command_force_n_in_world = {};
  EXPECT_EQ(sceneOf(without).find(" N"), std::string::npos);
  rt::Tick broken = tickInContact();
  broken.hip_m_in_world.y = broken.proxy_m_in_world.x = std::nan("");
  EXPECT_EQ(sceneOf(broken).find(" N"), std::string::npos);
  EXPECT_FALSE(hasSphere(sceneOf(broken), 0.03125));
  EXPECT_NE(sceneOf(broken).find("proxy"), std::string::npos) << "the entity must replace the earlier one";
}

}  // namespace
}  // namespace hapticd::trace::foxglove
