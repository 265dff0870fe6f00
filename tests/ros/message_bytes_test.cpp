// SPDX-License-Identifier: Apache-2.0
// The messages byte by byte, and member by member as an independent decoder reads them by the definitions;
// what is read of messages of others.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "daemon/trace/ros/message_definitions.h"
#include "daemon/trace/ros/message_set.h"
#include "tests/support/file_content.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::trace::ros {
namespace {

using Json = nlohmann::json;
using namespace test;

constexpr std::int64_t kTime_ns = 1'000'000'002;
const Header kBase{kTime_ns, "base"};
const rt::Quaternion kTurned{0.5, -0.5, 0.5, -0.5};

std::string hexOf(std::string_view bytes) {
  std::string text;
  for (const char byte : bytes) text += fmt::format("{:02x}", static_cast<unsigned char>(byte));
  return text;
}

std::string bytesOf(const std::string& hex) {
  std::string bytes;
  for (std::size_t i = 0; i < hex.size(); i += 2)
    bytes += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
  return bytes;
}

/// What a function appends.
std::string messageOf(auto encode) {
  std::string message;
  encode(message);
  return message;
}

/// The encoding, the time 1 s 2 ns, the frame "base", and zeros up to a multiple of eight.
const std::string kHeader =
    "00010000"
    "01000000"
    "02000000"
    "05000000"
    "6261736500" +
    std::string(14, '0');
const std::string kPose = kHeader +
                          "9a9999999999b93f"
                          "9a9999999999c93f"
                          "333333333333d33f" +
                          std::string(48, '0') + "000000000000f03f";
const std::string kWrench = kHeader +
                            "000000000000f03f"
                            "0000000000000040"
                            "0000000000000840" +
                            std::string(48, '0');

TEST(MessageBytes, OfAPoseAndAForceAreThoseOfRos2) {
  EXPECT_EQ(hexOf(messageOf([](std::string& to) { encodePose(kBase, {{0.1, 0.2, 0.3}, {}}, to); })), kPose);
  EXPECT_EQ(hexOf(messageOf([](std::string& to) { encodeWrench(kBase, {1, 2, 3}, {}, to); })), kWrench);
}

TEST(MessageBytes, AreReadInEitherOrderAndRefusedWhereTheyEndEarly) {
  // the same wrench as a computer with the other order of bytes writes it
  const std::string other =
      "00000000"
      "00000001"
      "00000002"
      "00000005"
      "6261736500" +
      std::string(14, '0') +
      "3ff0000000000000"
      "4000000000000000"
      "4008000000000000" +
      std::string(48, '0');
  for (const std::string& hex : {kWrench, other}) {
    const std::string bytes = bytesOf(hex);
    const auto wrench = decode<StampedWrench>(bytes);
    ASSERT_TRUE(wrench) << hex;
    EXPECT_EQ(wrench->header.time_ns, kTime_ns);
    EXPECT_EQ(wrench->header.frame, "base");
    EXPECT_EQ(wrench->force_n, (rt::Vec3{1, 2, 3}));
    EXPECT_EQ(wrench->torque_n_m, rt::Vec3{});
    for (std::size_t size = 0; size < bytes.size(); ++size)
      EXPECT_FALSE(decode<StampedWrench>(bytes.substr(0, size))) << size;
  }
  EXPECT_FALSE(decode<StampedWrench>(bytesOf("00030000" + kWrench.substr(8)))) << "another encoding";
}

TEST(MessageBytes, OfListsThatPretendToBeLongAreRefused) {
  const std::string empty = "00010000" + std::string(16, '0') + "0100000000000000";
  EXPECT_TRUE(decode<JointPositions>(bytesOf(empty + "00000000"
                                                     "00000000")));
  EXPECT_FALSE(decode<JointPositions>(bytesOf(empty + "ffffffff"
                                                      "00000000")));
  EXPECT_FALSE(decode<Announcement>(bytesOf("00010000" + std::string(32, '0') + "ffffffff")));
}

TEST(MessageBytes, OfAnAnnouncementAreReadAsTheyWereWritten) {
  Announcement announcement;
  for (std::size_t i = 0; i < announcement.participant.size(); ++i)
    announcement.participant[i] = static_cast<std::uint8_t>(i);
  Gid other{};
  other.fill(7);
  announcement.nodes = {{"/left", "box", {announcement.participant}, {other, announcement.participant}},
                        {"/", "second", {}, {}}};
  const std::string bytes = messageOf([&](std::string& to) { encodeAnnouncement(announcement, to); });
  const auto read = decode<Announcement>(bytes);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->participant, announcement.participant);
  ASSERT_EQ(read->nodes.size(), 2U);
  EXPECT_EQ(read->nodes[0].name_space, "/left");
  EXPECT_EQ(read->nodes[0].name, "box");
  EXPECT_EQ(read->nodes[0].readers, announcement.nodes[0].readers);
  EXPECT_EQ(read->nodes[0].writers, announcement.nodes[0].writers);
  EXPECT_EQ(read->nodes[1].name, "second");
}

Json vectorJson(double x, double y, double z) {
  return {{"x", x}, {"y", y}, {"z", z}};
}
Json quaternionJson(const rt::Quaternion& q) {
  return {{"x", q.x}, {"y", q.y}, {"z", q.z}, {"w", q.w}};
}
Json headerJson(const std::string& frame) {
  return {{"stamp", {{"sec", 1}, {"nanosec", 2}}}, {"frame_id", frame}};
}

/// The bytes of numbers, as the decoder prints lists of them.
template <typename Number>
Json bytesJson(const std::vector<Number>& numbers) {
  Json list = Json::array();
  for (const std::byte byte : std::as_bytes(std::span(numbers))) list.push_back(std::to_integer<int>(byte));
  return list;
}

/// visualization_msgs/Marker as it is left where there is nothing to say.
Json emptyMarkerJson() {
  return {{"header", headerJson("base")},
          {"ns", ""},
          {"id", 0},
          {"type", 0},
          {"action", 0},
          {"pose", {{"position", vectorJson(0, 0, 0)}, {"orientation", quaternionJson({})}}},
          {"scale", vectorJson(0, 0, 0)},
          {"color", {{"r", 0}, {"g", 0}, {"b", 0}, {"a", 0}}},
          {"lifetime", {{"sec", 0}, {"nanosec", 0}}},
          {"frame_locked", false},
          {"points", Json::array()},
          {"colors", Json::array()},
          {"texture_resource", ""},
          {"texture",
           {{"header", {{"stamp", {{"sec", 0}, {"nanosec", 0}}}, {"frame_id", ""}}},
            {"format", ""},
            {"data", Json::array()}}},
          {"uv_coordinates", Json::array()},
          {"text", ""},
          {"mesh_resource", ""},
          {"mesh_file", {{"filename", ""}, {"data", Json::array()}}},
          {"mesh_use_embedded_materials", false}};
}

/// A message, and what it is to mean.
struct Meaning {
  const char* name;
  std::string bytes;
  Json meaning;
};

std::vector<Meaning> meaningsOfTheBox() {
  const HeldButtons buttons{.time_ns = 0, .axes = {0.5F, -1.5F}, .held = {1, 0, 1}};
  const std::vector<Diagnostic> parts{{Diagnostic::Level::error, "a", "bc", "def", {{"k", "v"}, {"key", ""}}},
                                      {Diagnostic::Level::ok, "second", "", "", {}}};
  const std::vector<FixedFrame> frames{{"world", "camera", {{1, 2, 3}, kTurned}},
                                       {"world", "odd", {{4, 5, 6}, {}}}};
  const auto frameJson = [](const char* name, const Json& translation, const rt::Quaternion& rotation) {
    return Json{{"header", headerJson("world")},
                {"child_frame_id", name},
                {"transform", {{"translation", translation}, {"rotation", quaternionJson(rotation)}}}};
  };
  return {
      {"geometry_msgs/PoseStamped",
       messageOf([](std::string& to) {
         encodePose(kBase, {{1.25, -2.5, 3.75}, kTurned}, to);
       }),
       {{"header", headerJson("base")},
        {"pose", {{"position", vectorJson(1.25, -2.5, 3.75)}, {"orientation", quaternionJson(kTurned)}}}}},
      {"geometry_msgs/TwistStamped",
       messageOf([](std::string& to) {
         encodeVelocity(kBase, {4, 5, 6}, to);
       }),
       {{"header", headerJson("base")},
        {"twist", {{"linear", vectorJson(4, 5, 6)}, {"angular", vectorJson(0, 0, 0)}}}}},
      {"geometry_msgs/WrenchStamped",
       messageOf([](std::string& to) {
         encodeWrench(kBase, {7, 8, 9}, {10, 11, 12}, to);
       }),
       {{"header", headerJson("base")},
        {"wrench", {{"force", vectorJson(7, 8, 9)}, {"torque", vectorJson(10, 11, 12)}}}}},
      {"crtk_msgs/OperatingState",
       messageOf([](std::string& to) {
         encodeState(kBase, {"ENABLED", true, false}, to);
       }),
       {{"header", headerJson("base")}, {"state", "ENABLED"}, {"is_homed", true}, {"is_busy", false}}},
      {"sensor_msgs/Joy",
       messageOf([&](std::string& to) { encodeButtons(kBase, buttons, to); }),
       {{"header", headerJson("base")}, {"axes", buttons.axes}, {"buttons", buttons.held}}},
      {"diagnostic_msgs/DiagnosticArray",
       messageOf([&](std::string& to) {
         encodeDiagnostics({kTime_ns, ""}, parts, to);
       }),
       {{"header", headerJson("")},
        {"status",
         {{{"level", 2},
           {"name", "a"},
           {"message", "bc"},
           {"hardware_id", "def"},
           {"values", {{{"key", "k"}, {"value", "v"}}, {{"key", "key"}, {"value", ""}}}}},
          {{"level", 0},
           {"name", "second"},
           {"message", ""},
           {"hardware_id", ""},
           {"values", Json::array()}}}}}},
      {"tf2_msgs/TFMessage",
       messageOf([&](std::string& to) { encodeFrames(kTime_ns, frames, to); }),
       {{"transforms",
         {frameJson("camera", vectorJson(1, 2, 3), kTurned), frameJson("odd", vectorJson(4, 5, 6), {})}}}},
      {"rcl_interfaces/Log",
       messageOf([](std::string& to) { encodeLog(kTime_ns, LogLevel::warning, "box.mode", "hi", to); }),
       {{"stamp", {{"sec", 1}, {"nanosec", 2}}},
        {"level", 30},
        {"name", "box.mode"},
        {"msg", "hi"},
        {"file", ""},
        {"function", ""},
        {"line", 0}}},
      {"std_msgs/Bool", messageOf([](std::string& to) { encodeFlag(true, to); }), {{"data", true}}}};
}

std::vector<Meaning> meaningsOfTheScene() {
  const std::vector<float> xyz_m{0.5F, -1.5F, 2.5F, 3, 4, 5.25F};
  const auto fieldJson = [](const char* name, int offset) {
    return Json{{"name", name}, {"offset", offset}, {"datatype", 7}, {"count", 1}};
  };
  const DepthImage image{.width_px = 3, .height_px = 2, .depth_mm = {0, 1, 258, 1000, 65535, 7}};
  const PinholeCamera camera{640, 480, 594.5, 591.25, 339.5, 242.75};
  const std::vector<Marker> markers{{.action = Marker::Action::remove_all, .scale_m = {}, .colour = {}},
                                    {.name = "way",
                                     .id = 7,
                                     .kind = Marker::Kind::line_strip,
                                     .T_frame_marker = {{1, 2, 3}, kTurned},
                                     .scale_m = {0.5, 0.25, 0.125},
                                     .colour = {0.25F, 0.5F, 0.75F, 1},
                                     .points_m = {{4, 5, 6}, {7, 8, 9}},
                                     .text = "words"}};
  Json all = emptyMarkerJson();
  all.update({{"action", 3}, {"type", 1}});
  Json one = emptyMarkerJson();
  one.update({{"ns", "way"},
              {"id", 7},
              {"type", 4},
              {"pose", {{"position", vectorJson(1, 2, 3)}, {"orientation", quaternionJson(kTurned)}}},
              {"scale", vectorJson(0.5, 0.25, 0.125)},
              {"color", {{"r", 0.25}, {"g", 0.5}, {"b", 0.75}, {"a", 1}}},
              {"points", {vectorJson(4, 5, 6), vectorJson(7, 8, 9)}},
              {"text", "words"}});
  return {{"sensor_msgs/PointCloud2",
           messageOf([&](std::string& to) { encodePoints(kBase, xyz_m, to); }),
           {{"header", headerJson("base")},
            {"height", 1},
            {"width", 2},
            {"fields", {fieldJson("x", 0), fieldJson("y", 4), fieldJson("z", 8)}},
            {"is_bigendian", false},
            {"point_step", 12},
            {"row_step", 24},
            {"data", bytesJson(xyz_m)},
            {"is_dense", true}}},
          {"sensor_msgs/Image",
           messageOf([&](std::string& to) { encodeDepthImage(kBase, image, to); }),
           {{"header", headerJson("base")},
            {"height", 2},
            {"width", 3},
            {"encoding", "16UC1"},
            {"is_bigendian", 0},
            {"step", 6},
            {"data", bytesJson(image.depth_mm)}}},
          {"sensor_msgs/CameraInfo",
           messageOf([&](std::string& to) { encodeCameraInfo(kBase, camera, to); }),
           {{"header", headerJson("base")},
            {"height", 480},
            {"width", 640},
            {"distortion_model", "plumb_bob"},
            {"d", {0, 0, 0, 0, 0}},
            {"k", {594.5, 0, 339.5, 0, 591.25, 242.75, 0, 0, 1}},
            {"r", {1, 0, 0, 0, 1, 0, 0, 0, 1}},
            {"p", {594.5, 0, 339.5, 0, 0, 591.25, 242.75, 0, 0, 0, 1, 0}},
            {"binning_x", 0},
            {"binning_y", 0},
            {"roi", {{"x_offset", 0}, {"y_offset", 0}, {"height", 0}, {"width", 0}, {"do_rectify", false}}}}},
          {"visualization_msgs/MarkerArray",
           messageOf([&](std::string& to) { encodeMarkers(kBase, markers, to); }),
           {{"markers", {all, one}}}}};
}

TEST(MessageBytes, MeanInEachMemberWhatWasWrittenByTheirDefinitions) {
  if (std::filesystem::exists(NOT_INSTALLED)) GTEST_SKIP() << contentOf(NOT_INSTALLED);
  std::vector<Meaning> expected = meaningsOfTheBox();
  std::ranges::move(meaningsOfTheScene(), std::back_inserter(expected));
  std::string lines;
  for (const Meaning& each : expected)
    lines += Json{{"definition", completeDefinition(each.name)}, {"bytes", hexOf(each.bytes)}}.dump() + "\n";
  const TemporaryFolder folder;
  const Finished decoded =
      runToEnd({NODE_PROGRAM, DECODE_MESSAGES, folder.write("messages", lines).string()});
  ASSERT_EQ(decoded.ending, exitedWith(0)) << decoded.errors;
  std::istringstream output(decoded.output);
  std::size_t count = 0;
  for (std::string line; std::getline(output, line) && count < expected.size(); ++count) {
    const Meaning& each = expected[count];
    EXPECT_EQ(Json::parse(line), (Json{{"message", each.meaning}, {"bytes", hexOf(each.bytes)}}))
        << each.name;
  }
  EXPECT_EQ(count, expected.size());
}

}  // namespace
}  // namespace hapticd::trace::ros
