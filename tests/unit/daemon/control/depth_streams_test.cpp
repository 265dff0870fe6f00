// SPDX-License-Identifier: Apache-2.0
// The descriptor of the shared depth frames, over the real sockets.
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <array>
#include <cmath>
#include <cstring>
#include <deque>
#include <string>
#include <vector>

#include "config/descriptor.h"
#include "control_fixture.h"
#include "daemon/control/depth_streams.h"
#include "drivers/camera/kinect_image.h"
#include "drivers/depth_region/depth_region.h"
#include "tests/support/program.h"

namespace hapticd::daemon::test {
namespace {

using nlohmann::json;

constexpr const char* kShareDepth = R"({"method":"io.hapticd.Status.ShareDepth","more":true})";

/// What recvmsg() gives: bytes, and a descriptor if one came with them.
struct Received {
  std::string bytes;
  config::Descriptor descriptor;
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
                    config::Descriptor()};
  const cmsghdr* const rights = CMSG_FIRSTHDR(&message);
  if (rights && rights->cmsg_type == SCM_RIGHTS) {
    int descriptor = -1;
    std::memcpy(&descriptor, CMSG_DATA(rights), sizeof(descriptor));
    received.descriptor = config::Descriptor(descriptor);
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
  for (std::size_t client = 0; client < DepthStreams::kMostStreams; ++client) {
    clients.push_back(statusClient());
    clients.back().call(kShareDepth);
    EXPECT_TRUE(receive(clients.back().descriptor()).descriptor);
  }
  EXPECT_EQ(1, box.timesDepthWasShared());
  EXPECT_EQ(errorReply("io.hapticd.Status.TooManyStreams", {{"limit", DepthStreams::kMostStreams}}), [this] {
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
  // privileges_test shows who that is; here only that this method asks for it.
  start();
  const ControlService service(box, {});
  const auto method = std::ranges::find(service.methods(), "io.hapticd.Status.ShareDepth", &Method::name);
  ASSERT_NE(method, service.methods().end());
  EXPECT_TRUE(method->shows_depth);
}

}  // namespace
}  // namespace hapticd::daemon::test
