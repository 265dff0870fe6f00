// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <array>
#include <cmath>
#include <cstring>
#include <deque>
#include <string>
#include <vector>

#include "config/base/base64.h"
#include "config/base/descriptor.h"
#include "control_fixture.h"
#include "daemon/control/streams/depth_streams.h"
#include "drivers/camera/kinect_image.h"
#include "drivers/depth_region/depth_region.h"
#include "tests/support/program.h"

// The stream of a depth frame, over the real sockets.
namespace hapticd::daemon::test {
namespace {

using nlohmann::json;

constexpr const char* kGetSnapshot = R"({"method":"io.hapticd.Status.GetSnapshot","more":true})";
constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// The bytes of a text in base64, by the definition: 6 bits for each digit.
std::string decoded(const std::string& text) {
  std::string bytes;
  unsigned bits = 0;
  int held = 0;
  for (const char digit : text.substr(0, text.find('='))) {
    bits = (bits << 6 | static_cast<unsigned>(kDigits.find(digit))) & 0xffffU;
    held += 6;
    if (held < 8) continue;
    held -= 8;
    bytes += static_cast<char>(bits >> held & 0xffU);
  }
  return bytes;
}

TEST(Base64, WritesTheExamplesOfItsStandard) {
  const std::pair<std::string, std::string> examples[] = {{"", ""},
                                                          {"f", "Zg=="},
                                                          {"fo", "Zm8="},
                                                          {"foo", "Zm9v"},
                                                          {"foob", "Zm9vYg=="},
                                                          {"fooba", "Zm9vYmE="},
                                                          {"foobar", "Zm9vYmFy"}};
  for (const auto& [bytes, text] : examples) {
    EXPECT_EQ(text, base::base64(std::vector<std::uint8_t>(bytes.begin(), bytes.end())));
  }
  EXPECT_EQ("+/+/", base::base64(std::vector<std::uint8_t>{0xfb, 0xff, 0xbf}));
}

class SnapshotTest : public ControlFixture {};

TEST_F(SnapshotTest, GivesEveryPixelOfTheFrameInReplies) {
  config::Settings settings = box.settings();
  settings.camera.yaw_rad = 0.5;
  box.setSettings(settings);
  start();
  RawClient client = statusClient();
  client.call(kGetSnapshot);
  std::string bytes;
  json reply;
  do {
    const std::string text = client.reply();
    EXPECT_LE(text.size(), 80U * 1024);
    reply = json::parse(text, nullptr, false);
    ASSERT_TRUE(reply["parameters"]["rows"].is_string()) << text.substr(0, 200);
    EXPECT_EQ(bytes.size() / 1280, reply["parameters"]["firstRow"]);
    const json& header = reply["parameters"]["header"];
    EXPECT_EQ(!bytes.empty(), header.is_null());
    if (bytes.empty()) {
      EXPECT_GT(header["frame"], 0);
      EXPECT_EQ(640, header["width"]);
      EXPECT_EQ(480, header["height"]);
      EXPECT_EQ(594.214342, header["depthModel"]["fxPx"]);
      EXPECT_EQ(0.5, header["cameraPose"]["yawRad"]);
      EXPECT_TRUE(header["tick"]["hipMInWorld"].is_object());
    }
    bytes += decoded(reply["parameters"]["rows"]);
    EXPECT_EQ(0U, bytes.size() % 1280);
  } while (reply.contains("continues"));
  ASSERT_EQ(640U * 480 * 2, bytes.size());
  // the wall 1 m away, by the depth model
  const rt::DepthModelParameters model;
  const auto expected = std::lround((1 - model.b_per_m) / model.a_per_m);
  for (std::size_t pixel = 0; pixel < drivers::kKinectPixels; ++pixel) {
    const auto low = static_cast<std::uint8_t>(bytes[2 * pixel]);
    const auto high = static_cast<std::uint8_t>(bytes[2 * pixel + 1]);
    ASSERT_EQ(expected, low + 256 * high) << pixel;
  }
  client.call(R"({"method":"io.hapticd.Status.Nope"})");  // the stream has ended
  EXPECT_EQ("org.varlink.service.MethodNotFound", client.json()["error"]);
}

TEST_F(SnapshotTest, SaysWhyThereIsNoFrame) {
  config::Settings settings = box.settings();
  settings.camera.driver = "freenect";  // of which there is none
  box.setSettings(settings);
  start();
  RawClient client = statusClient();
  client.call(kGetSnapshot);
  const json refused = client.json();
  EXPECT_EQ("io.hapticd.Status.NoFrame", refused["error"]);
  EXPECT_EQ("camera: no depth frame has arrived yet (see hapticctl status for the camera)",
            refused["parameters"]["reason"]);
  EXPECT_EQ(errorReply("org.varlink.service.ExpectedMore"), askStatus("io.hapticd.Status.GetSnapshot"));
}

TEST_F(SnapshotTest, ForgetsClientsThatLeftAndTakesNoMoreThanEightAtATime) {
  server_options.read_limits.per_user = 32;
  start();
  box.holdJobs();
  {
    std::vector<RawClient> clients;
    for (int i = 0; i < 8; ++i) {
      clients.push_back(statusClient());
      clients.back().call(kGetSnapshot);
    }
    EXPECT_TRUE(box.waitForJobs(8));
  }
  RawClient ninth = statusClient();
  ninth.call(kGetSnapshot);
  EXPECT_EQ("io.hapticd.Status.NoFrame", ninth.json()["error"]);
  EXPECT_EQ(8, box.jobs());
  box.finishJobs();
  json reply = {{"error", "not yet"}};
  while (reply.contains("error")) {  // until the service has thrown the others away
    ninth.call(kGetSnapshot);
    reply = ninth.json();
  }
  EXPECT_EQ(0, reply["parameters"]["firstRow"]);
}

// The descriptor of the shared depth frames, over the real sockets.

constexpr const char* kShareDepth = R"({"method":"io.hapticd.Status.ShareDepth","more":true})";

/// What recvmsg() gives: bytes, and a descriptor if one came with them.
struct Received {
  std::string bytes;
  base::Descriptor descriptor;
};

Received receive(int socket) {
  std::array<char, 4096> bytes{};
  iovec part{bytes.data(), bytes.size()};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t count = ::recvmsg(socket, &message, MSG_CMSG_CLOEXEC);
  Received received{std::string(bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(count, 0))),
                    base::Descriptor()};
  const cmsghdr* const rights = CMSG_FIRSTHDR(&message);
  if (rights && rights->cmsg_type == SCM_RIGHTS) {
    int descriptor = -1;
    std::memcpy(&descriptor, CMSG_DATA(rights), sizeof(descriptor));
    received.descriptor = base::Descriptor(descriptor);
  }
  return received;
}

using DepthStreamsTest = ControlFixture;

TEST_F(DepthStreamsTest, HandOverTheMemoryWithTheFirstReply) {
  start();
  RawClient client = statusClient();
  client.call(kShareDepth);
  const Received reply = receive(client.descriptor());
  ASSERT_TRUE(reply.descriptor);
  ASSERT_EQ('\0', reply.bytes.back());
  const json parsed = json::parse(reply.bytes.substr(0, reply.bytes.size() - 1));
  EXPECT_EQ(true, parsed["continues"]);
  EXPECT_EQ(1, parsed["parameters"]["version"]);

  const auto reader = drivers::DepthRegionReader::open(reply.descriptor);
  ASSERT_TRUE(reader.has_value()) << reader.error().text();
  rt::DepthFrameHeader header;
  std::vector<std::byte> image;
  ASSERT_TRUE(hapticd::test::becomesTrue([&] { return reader->read(header, image); }));
  EXPECT_GT(header.frame, 0U);
  ASSERT_EQ(drivers::kKinectPixels * sizeof(std::uint16_t), image.size());
  // the wall 1 m away, by the depth model
  const rt::DepthModelParameters model;
  const auto expected = static_cast<std::uint16_t>(std::lround((1 - model.b_per_m) / model.a_per_m));
  for (std::size_t pixel = 0; pixel < drivers::kKinectPixels; ++pixel) {
    std::uint16_t raw = 0;
    std::memcpy(&raw, image.data() + 2 * pixel, sizeof(raw));
    ASSERT_EQ(expected, raw) << pixel;
  }
}

TEST_F(DepthStreamsTest, ShareOneMemoryAsLongAsOneOfThemIsOpen) {
  start();
  std::deque<RawClient> clients;
  for (std::size_t client = 0; client < DepthStreams::kMaxStreams; ++client) {
    clients.push_back(statusClient());
    clients.back().call(kShareDepth);
    EXPECT_TRUE(receive(clients.back().descriptor()).descriptor);
  }
  EXPECT_EQ(1, box.timesDepthWasShared());
  EXPECT_EQ(errorReply("io.hapticd.Status.TooManyStreams", {{"limit", DepthStreams::kMaxStreams}}), [this] {
    RawClient one_more = statusClient();
    one_more.call(kShareDepth);
    return one_more.json();
  }());
  while (clients.size() > 1) clients.pop_back();
  EXPECT_TRUE(box.sharesDepth());
  clients.clear();
  EXPECT_TRUE(box.waitUntilDepthIsHidden());
}

TEST_F(DepthStreamsTest, AreRefusedWithTheReasonWhereThereIsNoMemory) {
  box.failToShareDepth();
  start();
  RawClient client = statusClient();
  client.call(kShareDepth);
  EXPECT_EQ("io.hapticd.Status.NoFrame", client.json()["error"]);
  EXPECT_TRUE(askStatus("io.hapticd.Status.ShareDepth")["error"] == "org.varlink.service.ExpectedMore");
}

TEST_F(DepthStreamsTest, AreRefusedToWhomMayNotSeeTheDepthImage) {
  // sockets_test shows who that is; here only that this method asks for it.
  start();
  const ControlService service(box, {});
  const auto method = std::ranges::find(service.methods(), "io.hapticd.Status.ShareDepth", &Method::name);
  ASSERT_NE(method, service.methods().end());
  EXPECT_TRUE(method->shows_depth);
}

}  // namespace
}  // namespace hapticd::daemon::test
