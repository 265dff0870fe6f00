// SPDX-License-Identifier: Apache-2.0
// hapticd-view --move-hand beside a box: who may move the hand, and which hand.
#include <gtest/gtest.h>
#include <sysexits.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/file_content.h"
#include "tests/view_bridge/bridge_under_test.h"

namespace hapticd::test {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

struct Box {
  explicit Box(const std::string& follows = "true")
      : daemon(home, kWallYaml, {"simulated_handle.follows_person=" + follows}) {
    EXPECT_TRUE(daemon.answers());
  }
  std::vector<std::string> moving() const {
    return {"--move-hand", "--control-socket", home.controlSocket()};
  }

  DaemonHome home;
  Daemon daemon;
};

constexpr const char* kTarget = R"({"type":"hand","target":[0.05,0.1,-0.5]})";

/// Sends a target until the HIP is there; the distance at the end.
double distanceLed(WebSocketPeer& page) {
  double distance_m = 1;
  for (int i = 0; i < 2000 && !(distance_m < 0.002); ++i) {
    page.sendText(kTarget);
    const json hip = page.nextOf("window").value("hip", json());
    if (!hip.is_array()) continue;
    distance_m =
        std::hypot(hip[0].get<double>() - 0.05, hip[1].get<double>() - 0.1, hip[2].get<double>() + 0.5);
  }
  return distance_m;
}

/// The problem in the next answer to targets.
std::string problemOf(WebSocketPeer& page) {
  page.sendText(kTarget);
  return page.nextOf("hand").value("problem", "no answer");
}

TEST(ViewHandRight, MovesTheHandAndNothingElse) {
  const Box box;
  BridgeUnderTest bridge(box.home, box.moving());
  WebSocketPeer page(bridge.port(), bridge.liveTarget());
  const json hello = page.nextOf("hello", 1);
  EXPECT_EQ(hello.value("movesHand", false), true);
  EXPECT_EQ(hello.value("addsFixtures", true), false);
  page.sendText(R"({"type":"fixture","add":{"name":"nerve","kind":"point","position_m":[0,0,-2]}})");
  EXPECT_TRUE(page.nextOf("fixture").value("problem", "").starts_with("nothing was changed"));
  for (const char* wrong :
       {R"({"type":"hand"})", R"({"type":"hand","target":[0,0]})", R"({"type":"hand","target":[0,0,null]})",
        R"({"type":"hand","target":[1e308,1e308,0]})"})
    page.sendText(wrong);
  EXPECT_LT(distanceLed(page), 0.002);
}

TEST(ViewHandRight, IsForOnePageAtATimeUntilItLeaves) {
  const Box box;
  BridgeUnderTest bridge(box.home, box.moving());
  WebSocketPeer second(bridge.port(), bridge.liveTarget());
  {
    WebSocketPeer first(bridge.port(), bridge.liveTarget());
    EXPECT_EQ(problemOf(first), "");
    EXPECT_TRUE(problemOf(second).starts_with("another page moves the hand"));
  }
  std::string problem = "none yet";
  for (int i = 0; i < 200 && !problem.empty(); ++i) {
    problem = problemOf(second);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));  // at most 100 messages a second
  }
  EXPECT_EQ(problem, "");
}

TEST(ViewHandRight, IsRefusedByABoxWhoseHandFollowsNoPerson) {
  const Box box("false");
  BridgeUnderTest bridge(box.home, box.moving());
  WebSocketPeer page(bridge.port(), bridge.liveTarget());
  EXPECT_TRUE(problemOf(page).starts_with("the handle simulated follows no person"));
}

TEST(ViewHandRight, IsNotThatOfABridgeWithoutTheOption) {
  const Box box;
  BridgeUnderTest bridge(box.home);
  WebSocketPeer page(bridge.port(), bridge.liveTarget());
  EXPECT_EQ(page.nextOf("hello", 1).value("movesHand", true), false);
  EXPECT_EQ(problemOf(page), "hapticd-view may not move the hand (start it with --move-hand)");
}

TEST(ViewHandRight, TakesTheTokenAndIsNotGivenToTheNetwork) {
  const Box box;
  BridgeUnderTest bridge(box.home, box.moving());
  EXPECT_TRUE(WebSocketPeer(bridge.port(), "/live").answer().starts_with("HTTP/1.1 401"));
  const TemporaryFolder folder;
  folder.write("index.html", "");
  for (const auto& options : std::vector<std::vector<std::string>>{
           {"--no-token"}, {"--allow-origin", "https://example.org"}, {"--listen", "0.0.0.0:0"}}) {
    std::vector<std::string> all{HAPTICD_VIEW_PROGRAM, "--page",           folder.path(),
                                 "--move-hand",        "--control-socket", box.home.controlSocket()};
    all.insert(all.end(), options.begin(), options.end());
    if (options[0] != "--no-token") all.insert(all.end(), {"--token-file", folder.path() / "token"});
    const Finished refused = runToEnd(all, {});
    EXPECT_EQ(refused.ending, exitedWith(EX_USAGE)) << options[0] << refused.errors;
    EXPECT_TRUE(contains(refused.errors, "--move-hand"));
  }
  for (const char* unit : {"systemd/hapticd-view.service.in", "systemd/hapticd-view.socket.in"}) {
    const std::string text = contentOf(fs::path(HAPTICD_SOURCE_FOLDER) / unit);
    EXPECT_EQ(text.find("--move-hand"), std::string::npos) << unit;
  }
}

}  // namespace
}  // namespace hapticd::test
