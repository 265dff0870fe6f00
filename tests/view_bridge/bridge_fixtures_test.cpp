// SPDX-License-Identifier: Apache-2.0
// Fixtures that a page adds through hapticd-view: only where the program was started for that, only
// additions, no more than a person makes, and with the daemon's own checks.
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "tests/view_bridge/bridge_under_test.h"

namespace hapticd::test {
namespace {

using nlohmann::json;

std::vector<std::string> adding(const DaemonHome& home) {
  return {"--add-fixtures", "--control-socket", home.controlSocket()};
}

std::string request(const json& message) {
  json whole = message;
  whole["type"] = "fixture";
  return whole.dump();
}

json sphere(const std::string& name, double radius_m = 0.05) {
  return {{"name", name}, {"kind", "sphere"}, {"position_m", {0, 0, -0.8}}, {"radius_m", radius_m}};
}

std::vector<std::string> namesIn(const DaemonHome& home) {
  const json reply = json::parse(home.control({"--json", "fixture", "list"}).output, nullptr, false);
  std::vector<std::string> names;
  for (const json& fixture : reply.value("fixtures", json::array()))
    names.push_back(fixture.value("name", ""));
  return names;
}

/// The answer to a request, which is repeated while the bridge asks to wait.
json answerTo(WebSocketPeer& peer, const json& message) {
  constexpr int kMaxTries = 100;
  for (int i = 0; i < kMaxTries; ++i) {
    peer.sendText(request(message));
    const json answer = peer.nextOf("fixture");
    if (answer.value("problem", "").find("try again") == std::string::npos) return answer;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return json();
}

TEST(View, AddsAndRemovesFixturesWhereItWasStartedForThat) {
  const DaemonHome home;
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  home.control(
      {"fixture", "add", "vein", "--kind", "sphere", "--position-m", "0,0,-0.7", "--radius-m", "0.01"});
  BridgeUnderTest bridge(home, adding(home));
  WebSocketPeer peer(bridge.port(), bridge.liveTarget());
  EXPECT_EQ(true, peer.nextOf("hello", 1).value("addsFixtures", false));

  EXPECT_EQ("", answerTo(peer, {{"add", sphere("nerve")}}).value("problem", "-"));
  EXPECT_EQ((std::vector<std::string>{"vein", "nerve"}), namesIn(home));

  const std::string twice = answerTo(peer, {{"add", sphere("nerve")}}).value("problem", "");
  EXPECT_NE(std::string::npos, twice.find("same name")) << twice;
  const std::string wrong = answerTo(peer, {{"add", sphere("artery", -1)}}).value("problem", "");
  EXPECT_NE(std::string::npos, wrong.find("radius_m")) << wrong;
  const std::string foreign = answerTo(peer, {{"remove", "vein"}}).value("problem", "");
  EXPECT_NE(std::string::npos, foreign.find("added here")) << foreign;
  EXPECT_EQ((std::vector<std::string>{"vein", "nerve"}), namesIn(home));

  EXPECT_EQ("", answerTo(peer, {{"remove", "nerve"}}).value("problem", "-"));
  EXPECT_EQ(std::vector<std::string>{"vein"}, namesIn(home));
}

TEST(View, ChangesNothingElseOfTheBox) {
  const DaemonHome home;
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  BridgeUnderTest bridge(home, adding(home));
  WebSocketPeer peer(bridge.port(), bridge.liveTarget());
  const std::string before = home.control({"--json", "get"}).output;
  for (const char* text :
       {R"({"type":"engage"})", R"({"type":"fixture","engage":true})", R"({"type":"fixture","add":"all"})",
        R"({"type":"fixture","remove":["vein"]})", R"({"type":"set","parameters":{"force.radius_m":0.01}})",
        R"({"method":"io.hapticd.Control.Engage","parameters":{}})", R"({"type":"fixture"})"}) {
    peer.sendText(text);
  }
  // what follows is answered after them
  EXPECT_EQ("", answerTo(peer, {{"add", sphere("nerve")}}).value("problem", "-"));
  EXPECT_EQ(before, home.control({"--json", "get"}).output);
  EXPECT_EQ("idle", daemon.status().at("mode"));
  EXPECT_EQ(std::vector<std::string>{"nerve"}, namesIn(home));
}

TEST(View, AddsNoMoreThanAPersonMakes) {
  const DaemonHome home;
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  BridgeUnderTest bridge(home, adding(home));
  WebSocketPeer peer(bridge.port(), bridge.liveTarget());
  constexpr int kRequests = 100;
  int refused = 0;
  for (int i = 0; i < kRequests; ++i) peer.sendText(request({{"add", sphere("f" + std::to_string(i))}}));
  for (int i = 0; i < kRequests; ++i) {
    const std::string problem = peer.nextOf("fixture").value("problem", "-");
    if (problem.find("try again") != std::string::npos) ++refused;
  }
  EXPECT_EQ(kRequests - static_cast<int>(namesIn(home).size()), refused);
  EXPECT_GT(refused, kRequests / 2);
}

TEST(View, RefusesFixturesWithoutTheOption) {
  const DaemonHome home;
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  BridgeUnderTest bridge(home);
  WebSocketPeer peer(bridge.port(), bridge.liveTarget());
  EXPECT_EQ(false, peer.nextOf("hello", 1).value("addsFixtures", true));
  const std::string problem = answerTo(peer, {{"add", sphere("nerve")}}).value("problem", "");
  EXPECT_NE(std::string::npos, problem.find("--add-fixtures")) << problem;
  EXPECT_TRUE(namesIn(home).empty());
}

TEST(View, StartsForAddingOnlyWhereItMayAndWithAToken) {
  const TemporaryFolder folder;
  const std::string token = (folder.path() / "token").string();
  const auto refusal = [&](const std::vector<std::string>& options) {
    std::vector<std::string> command{HAPTICD_VIEW_PROGRAM, "--add-fixtures"};
    command.insert(command.end(), options.begin(), options.end());
    return runToEnd(command);
  };
  const Finished absent =
      refusal({"--token-file", token, "--control-socket", (folder.path() / "Control").string()});
  EXPECT_EQ(exitedWith(77), absent.ending);
  EXPECT_NE(std::string::npos, absent.errors.find("start hapticd first")) << absent.errors;
  EXPECT_EQ(exitedWith(64), refusal({"--no-token"}).ending);
}

}  // namespace
}  // namespace hapticd::test
