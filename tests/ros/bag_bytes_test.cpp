// SPDX-License-Identifier: Apache-2.0
// Messages of bags are, byte by byte, those that go over the wire.
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "ros_messages.h"
#include "tests/ros/ros_listener.h"
#include "tests/support/program.h"
#include "tools/hapticd-ros/dds/publications.h"
#include "tools/lib/ros/cdr_messages.h"

namespace hapticd::test {
namespace {

using tools::ros::Publications;

constexpr std::int64_t kTime_ns = 1'700'000'000'987'654'321;
constexpr std::string_view kFrame = "hapticd/world";

/// RTPS fills messages up to whole words, and says by how many bytes in the last two bits of the encoding.
std::string withoutPadding(std::string bytes) {
  const auto padding = static_cast<std::size_t>(bytes.at(3) & 3);
  bytes.resize(bytes.size() - padding);
  bytes[3] = 0;
  return bytes;
}

TEST(BagBytes, AreThoseOnTheWire) {
  const int domain = ownDomain();
  auto participant = tools::ros::Participant::join({.domain = domain, .interface = ""});
  ASSERT_TRUE(participant) << participant.error().text();
  auto opened = Publications::open(*participant, "hapticd", std::string(kFrame));
  ASSERT_TRUE(opened) << opened.error().text();
  Publications& publications = *opened;
  RosListener listener(domain);
  const auto compare = [&listener](const std::string& topic, const dds_topic_descriptor_t& type, auto publish,
                                   auto encode) {
    listener.subscribe(topic, type);
    ASSERT_TRUE(becomesTrue([&] { return listener.isMatched(topic); })) << topic;
    publish();
    std::vector<std::string> messages;
    ASSERT_TRUE(becomesTrue([&] { return !(messages = listener.take(topic)).empty(); })) << topic;
    std::string encoded;
    encode(encoded);
    EXPECT_EQ(hexOf(encoded), hexOf(withoutPadding(messages.front()))) << topic;
  };
  const tools::ros::Header header{kTime_ns, kFrame};
  const rt::RigidPose pose{{0.1, -0.2, 1e-9}, {0.5, -0.5, 0.5, -0.5}};
  const rt::Vec3 vector{1.5, -2.25, 1.0 / 3};
  compare(
      "rt/hapticd/measured_cp", geometry_msgs_msg_dds__PoseStamped__desc,
      [&] { publications.measuredPose(kTime_ns, pose); },
      [&](std::string& to) { encodePose(header, pose, to); });
  compare(
      "rt/hapticd/measured_cv", geometry_msgs_msg_dds__TwistStamped__desc,
      [&] { publications.measuredVelocity(kTime_ns, vector); },
      [&](std::string& to) { encodeVelocity(header, vector, to); });
  compare(
      "rt/hapticd/setpoint_cf", geometry_msgs_msg_dds__WrenchStamped__desc,
      [&] { publications.setpointForce(kTime_ns, vector); },
      [&](std::string& to) { encodeForce(header, vector, to); });
  compare(
      "rt/hapticd/operating_state", crtk_msgs_msg_dds__OperatingState__desc,
      [&] { publications.operatingState(kTime_ns, "ENABLED", true, false); },
      [&](std::string& to) {
        encodeState(header, {"ENABLED", true, false}, to);
      });
  tools::ros::HeldButtons buttons{.time_ns = 0, .axes = {0.5F}, .held = {1, 0, 1}};
  compare(
      "rt/hapticd/buttons", sensor_msgs_msg_dds__Joy__desc,
      [&] { publications.buttons(kTime_ns, buttons.axes, buttons.held); },
      [&](std::string& to) { encodeButtons(header, buttons, to); });
  const std::vector<tools::ros::FixedFrame> frames{{"world", "camera", pose}, {"world", "odd", {vector, {}}}};
  compare(
      "rt/tf_static", tf2_msgs_msg_dds__TFMessage__desc, [&] { publications.fixedFrames(kTime_ns, frames); },
      [&](std::string& to) { encodeFrames(kTime_ns, frames, to); });
}

}  // namespace
}  // namespace hapticd::test
