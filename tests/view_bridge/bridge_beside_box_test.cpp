// SPDX-License-Identifier: Apache-2.0
// hapticd-view beside a running box: what its clients see, and that the box does not notice it.
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "rt/depth/depth_frame_header.h"
#include "tests/support/sanitizer.h"
#include "tests/view_bridge/bridge_under_test.h"

namespace hapticd::test {
namespace {

using nlohmann::json;

std::uint64_t ticksOf(const json& status) {
  return status.at("loop").at("counters").at("ticks").get<std::uint64_t>();
}

/// A box with a wall in reach, engaged.
struct EngagedBox {
  EngagedBox() : daemon(home, kWallYaml, {"control.engage_at_start=true"}) {
    EXPECT_TRUE(daemon.answers());
    EXPECT_TRUE(daemon.reaches([](const json& status) { return status.at("mode") == "engaged"; }));
  }
  DaemonHome home;
  Daemon daemon;
};

TEST(View, ShowsStateParametersForcesAndEvents) {
  EngagedBox box;
  BridgeUnderTest bridge(box.home);
  WebSocketPeer peer(bridge.port(), bridge.liveTarget());
  const json hello = peer.nextOf("hello", 1);
  EXPECT_EQ(hello.value("protocol", 0), 1);
  EXPECT_EQ(peer.nextOf("box").value("reachable", false), true);
  const json state = peer.nextOf("state");
  ASSERT_TRUE(state.contains("status"));
  EXPECT_EQ(state["status"].value("mode", ""), "engaged");
  EXPECT_TRUE(state["status"].contains("scene"));
  EXPECT_FALSE(state["status"].contains("tick"));
  const json parameters = peer.nextOf("parameters");
  ASSERT_TRUE(parameters.contains("parameters"));
  EXPECT_EQ(parameters["parameters"].value("force.law", ""), "nearest_springs");

  const json window = peer.nextOf("window");
  EXPECT_GT(window.value("ticks", 0), 0);
  EXPECT_EQ(window.value("law", ""), "nearest_springs");
  // the hand begins 30 mm before the wall at z = -1 m, moves 20 mm on and presses (kWallYaml)
  EXPECT_NEAR(window.at("hip").at(2).get<double>(), -1, 0.05);
}

TEST(View, MissesNoTick) {
  EngagedBox box;
  BridgeUnderTest bridge(box.home);
  WebSocketPeer peer(bridge.port(), bridge.liveTarget());
  std::optional<std::uint64_t> last;
  std::uint64_t counted = 0;
  std::uint64_t first = 0;
  for (int i = 0; i < 20; ++i) {
    const json window = peer.nextOf("window");
    ASSERT_TRUE(window.is_object());
    const auto ticks = window.at("ticks").get<std::uint64_t>() + window.at("lost").get<std::uint64_t>();
    const auto number = window.at("number").get<std::uint64_t>();
    if (!last) first = number - window.at("ticks").get<std::uint64_t>();
    counted += ticks;
    last = number;
  }
  EXPECT_EQ(*last - first, counted);
}

TEST(View, ShowsTheDepthFramesOfTheCamera) {
  EngagedBox box;
  BridgeUnderTest bridge(box.home);
  WebSocketPeer peer(bridge.port(), bridge.liveTarget());
  std::uint64_t last = 0;
  for (int i = 0; i < 3; ++i) {
    const std::string message = peer.nextBinary();
    ASSERT_GT(message.size(), 8 + sizeof(rt::DepthFrameHeader));
    EXPECT_EQ(message.substr(0, 8), std::string("\1\0\0\0\0\0\0\0", 8));
    rt::DepthFrameHeader header;
    std::memcpy(&header, message.data() + 8, sizeof header);
    ASSERT_EQ(faultOf(header), rt::DepthHeaderFault::none);
    EXPECT_EQ(message.size(), 8 + sizeof header + header.imageBytes());
    EXPECT_GT(header.frame, last);
    last = header.frame;
    // the middle pixel of a wall at 1 m, to the step of the raw value there
    std::uint16_t raw = 0;
    const std::size_t pixel = std::size_t{header.stride_bytes} * (header.height_px / 2) + header.width_px;
    std::memcpy(&raw, message.data() + 8 + sizeof header + pixel, sizeof raw);
    const double per_m = header.depth_law_coefficients[0] * raw + header.depth_law_coefficients[1];
    EXPECT_NEAR(1 / per_m, 1.0, std::fabs(header.depth_law_coefficients[0]));
  }
}

TEST(View, ShowsNoDepthToAClientThatAsksForNone) {
  EngagedBox box;
  BridgeUnderTest bridge(box.home);
  WebSocketPeer peer(bridge.port(), bridge.liveTarget());
  EXPECT_FALSE(peer.nextBinary().empty());
  peer.sendText(R"({"type":"depth","maxHz":0})");
  // what was on its way may still come; then there is none among the windows of about a second
  int frames = 0;
  for (int windows = 0; windows < 100;) {
    const auto message = peer.next();
    ASSERT_TRUE(message);
    if (message->opcode == 2 && windows > 50) ++frames;
    if (message->opcode == 1 && message->payload.starts_with(R"({"type":"window")")) ++windows;
  }
  EXPECT_EQ(frames, 0);
}

TEST(View, ShowsAChangedParameter) {
  EngagedBox box;
  BridgeUnderTest bridge(box.home);
  WebSocketPeer peer(bridge.port(), bridge.liveTarget());
  ASSERT_TRUE(peer.nextOf("parameters").is_object());
  ASSERT_EQ(box.home.control({"set", "force.stiffness_n_per_m=321"}).ending, exitedWith(0));
  json parameters;
  do {
    parameters = peer.nextOf("parameters");
    ASSERT_TRUE(parameters.is_object());
  } while (parameters.at("parameters").at("force.stiffness_n_per_m") != 321);
  EXPECT_EQ(peer.nextOf("window").value("type", ""), "window");
}

TEST(View, SaysWhyThereIsNoBoxAndShowsOneThatComes) {
  const DaemonHome home;
  BridgeUnderTest bridge(home);
  WebSocketPeer peer(bridge.port(), bridge.liveTarget());
  const json absent = peer.nextOf("box");
  EXPECT_EQ(absent.value("reachable", true), false);
  EXPECT_TRUE(contains(absent.value("reason", ""), "systemctl start hapticd"));
  for (int start = 0; start < 2; ++start) {
    Daemon daemon(home);
    ASSERT_TRUE(daemon.answers());
    json there;
    do {  // the reason why there is none may change before
      there = peer.nextOf("box");
      ASSERT_TRUE(there.is_object()) << start;
    } while (!there.value("reachable", false));
    EXPECT_TRUE(peer.nextOf("window").is_object()) << start;
    EXPECT_FALSE(peer.nextBinary().empty()) << start;
    daemon.terminate();
    json gone;
    do {
      gone = peer.nextOf("box");
      ASSERT_TRUE(gone.is_object());
    } while (gone.value("reachable", true));
  }
}

TEST(View, AsksForNoTokenWhereTheBoxShowsItsDepthToEverybody) {
  const DaemonHome home;
  Daemon daemon(home, kWallYaml, {"control.depth_for_everyone=true"});
  ASSERT_TRUE(daemon.answers());
  BridgeUnderTest bridge(home);
  WebSocketPeer peer(bridge.port(), "/live");
  EXPECT_TRUE(peer.isOpen()) << peer.answer();
}

/// What the box shows when nothing of its ticks got lost while it was looked at.
void expectUntouched(const json& status) {
  EXPECT_EQ(status.at("mode"), "engaged");
  EXPECT_EQ(status.at("loop").at("traceTicksDropped"), 0);
}

TEST(View, IsNotNoticedWhenItStopsOrIsKilled) {
  EngagedBox box;
  BridgeUnderTest bridge(box.home);
  WebSocketPeer peer(bridge.port(), bridge.liveTarget());
  ASSERT_FALSE(peer.nextBinary().empty());
  for (const int signal : {SIGSTOP, SIGKILL}) {
    bridge.program().signal(signal);
    const std::uint64_t before = ticksOf(box.daemon.status());
    // longer than its streams' buffers hold: 4096 ticks
    EXPECT_TRUE(box.daemon.reaches([&](const json& status) { return ticksOf(status) > before + 5000; }));
    expectUntouched(box.daemon.status());
  }
}

TEST(View, KeepsItsMemoryAndShowsOthersEverythingBesideAClientThatHardlyReads) {
  EngagedBox box;
  BridgeUnderTest bridge(box.home);
  WebSocketPeer slow(bridge.port(), bridge.liveTarget(), "", /*receive_buffer=*/4096);
  WebSocketPeer fast(bridge.port(), bridge.liveTarget());
  ASSERT_TRUE(slow.isOpen() && fast.isOpen());
  ASSERT_FALSE(fast.nextBinary().empty());
  slow.raw().receive(1000);
  const std::size_t before = bridge.residentBytes();
  // each frame is 600 KiB: kept for the slow one, ninety would be 50 MiB
  std::uint64_t first = 0;
  std::uint64_t last = 0;
  for (int frame = 0; frame < 90; ++frame) {
    const std::string message = fast.nextBinary();
    ASSERT_GT(message.size(), 8 + sizeof(rt::DepthFrameHeader));
    rt::DepthFrameHeader header;
    std::memcpy(&header, message.data() + 8, sizeof header);
    if (first == 0) first = header.frame;
    last = header.frame;
  }
  EXPECT_GE(last, first + 89);
  EXPECT_LT(bridge.residentBytes(), before + 10 * 1024 * 1024);
  slow.raw() = RawClient(bridge.port());  // closes the connection
  EXPECT_TRUE(bridge.logs("replaced by newer ones"));
  expectUntouched(box.daemon.status());
}

WebSocketPeer foxglovePeer(const BridgeUnderTest& bridge, int receive_buffer = 0) {
  return {bridge.port(), "/?token=" + bridge.token(), "Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n",
          receive_buffer};
}

/// The number of the channel of that topic.
std::uint32_t channelOf(WebSocketPeer& peer, const std::string& topic) {
  for (int messages = 0; messages < 10; ++messages) {
    const auto message = peer.next();
    if (!message) break;
    const json text = json::parse(message->payload);
    if (text.at("op") != "advertise") continue;
    for (const json& channel : text.at("channels")) {
      if (channel.at("topic") == topic) return channel.at("id");
    }
  }
  ADD_FAILURE() << "no channel " << topic;
  return 0;
}

TEST(View, KeepsItsMemoryBesideAClientThatSubscribesEverAnewAndReadsNothing) {
  if (kMemoryOfSanitizer) GTEST_SKIP() << "the sanitizer keeps what has been freed";
  EngagedBox box;
  BridgeUnderTest bridge(box.home);
  WebSocketPeer greedy = foxglovePeer(bridge, /*receive_buffer=*/4096);
  ASSERT_TRUE(greedy.isOpen()) << greedy.answer();
  const std::uint32_t channel = channelOf(greedy, "/hapticd/depth_image");
  WebSocketPeer fast(bridge.port(), bridge.liveTarget());
  ASSERT_FALSE(fast.nextBinary().empty());
  const std::size_t before = bridge.residentBytes();
  // each frame is 600 KiB: ninety would be 50 MiB
  for (std::uint32_t id = 1; id <= 90; ++id) {
    greedy.sendText(
        json{{"op", "subscribe"}, {"subscriptions", {{{"id", id}, {"channelId", channel}}}}}.dump());
    ASSERT_FALSE(fast.nextBinary().empty());
    greedy.sendText(json{{"op", "unsubscribe"}, {"subscriptionIds", {id}}}.dump());
  }
  EXPECT_LT(bridge.residentBytes(), before + 10 * 1024 * 1024);
}

TEST(View, KeepsItsMemoryBesideClientsWhoseRequestsNobodyCanAnswer) {
  if (kMemoryOfSanitizer) GTEST_SKIP() << "the sanitizer keeps what has been freed";
  const DaemonHome home;
  BridgeUnderTest bridge(home);
  std::vector<WebSocketPeer> peers;
  for (int i = 0; i < 8; ++i) {
    peers.push_back(foxglovePeer(bridge));
    ASSERT_TRUE(peers.back().isOpen()) << peers.back().answer();
  }
  // 60 KiB each, of which every name takes at least as much again as a std::string
  json request{{"op", "getParameters"}, {"parameterNames", json::array()}};
  for (int i = 0; i < 15'000; ++i) request["parameterNames"].push_back("p");
  const std::string text = request.dump();
  const std::size_t before = bridge.residentBytes();
  for (WebSocketPeer& peer : peers) {
    for (int i = 0; i < 64; ++i) peer.sendText(text);
    peer.sendText(R"({"op":"setParameters"})");
  }
  // its answer shows that the requests before it have been taken
  for (WebSocketPeer& peer : peers) {
    bool refused = false;
    while (!refused) {
      const auto message = peer.next();
      ASSERT_TRUE(message);
      refused = message->payload.find("setParameters is refused") != std::string::npos;
    }
  }
  EXPECT_LT(bridge.residentBytes(), before + 20 * 1024 * 1024);
}

TEST(View, ShowsAllToEightClientsAtOnce) {
  EngagedBox box;
  BridgeUnderTest bridge(box.home);
  std::vector<WebSocketPeer> peers;
  for (int i = 0; i < 8; ++i) peers.emplace_back(bridge.port(), bridge.liveTarget());
  for (WebSocketPeer& peer : peers) {
    EXPECT_TRUE(peer.nextOf("window").is_object());
    EXPECT_FALSE(peer.nextBinary().empty());
  }
  expectUntouched(box.daemon.status());
}

}  // namespace
}  // namespace hapticd::test
