// SPDX-License-Identifier: Apache-2.0
// hapticd-view --add-fixtures: to whom it gives the right of its user, and to whom it does not.
#include <gtest/gtest.h>
#include <sysexits.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
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
  explicit Box(const std::vector<std::string>& set = {}) : daemon(home, kWallYaml, set) {
    EXPECT_TRUE(daemon.answers());
  }
  std::vector<std::string> adding() const {
    return {"--add-fixtures", "--control-socket", home.controlSocket()};
  }

  DaemonHome home;
  Daemon daemon;
};

/// Runs it until it ends, with a page and a token of its own.
Finished finishedWith(std::vector<std::string> options, const ProgramOptions& program = {}) {
  const TemporaryFolder folder;
  folder.write("index.html", "");
  if (program.user) fs::permissions(folder.path(), fs::perms::all);
  const auto orDefault = [&](const std::string& option, const std::string& value) {
    if (std::ranges::find(options, option) != options.end()) return;
    options.insert(options.end(), {option, value});
  };
  orDefault("--page", folder.path());
  orDefault("--listen", "127.0.0.1:0");
  if (std::ranges::find(options, "--no-token") == options.end())
    orDefault("--token-file", folder.path() / "token");
  options.insert(options.begin(), HAPTICD_VIEW_PROGRAM);
  return runToEnd(options, program);
}

TEST(ViewFixtureRight, IsThatOfItsUser) {
  const Box box;
  // who may only read is refused there in the same way
  const Finished reader = finishedWith({"--add-fixtures", "--control-socket", box.home.statusSocket()});
  EXPECT_EQ(reader.ending, exitedWith(EX_NOPERM)) << reader.errors;
  EXPECT_TRUE(contains(reader.errors, "this user may not control the box"));
  if (::geteuid() != 0) GTEST_SKIP() << "needs root to be another user";
  const Finished nobody = finishedWith(box.adding(), {.user = 65534});
  EXPECT_EQ(nobody.ending, exitedWith(EX_NOPERM)) << nobody.errors;
  EXPECT_TRUE(contains(nobody.errors, "member of the group haptic"));
}

TEST(ViewFixtureRight, IsNotGivenWhereOthersWouldGetIt) {
  const Box box;
  for (const auto& options : std::vector<std::vector<std::string>>{
           {"--no-token"}, {"--allow-origin", "https://example.org"}, {"--listen", "0.0.0.0:0"}}) {
    std::vector<std::string> all = box.adding();
    all.insert(all.end(), options.begin(), options.end());
    const Finished refused = finishedWith(all);
    EXPECT_EQ(refused.ending, exitedWith(EX_USAGE)) << options[0] << refused.errors;
    EXPECT_TRUE(contains(refused.errors, "--add-fixtures"));
  }
  const Finished absent = finishedWith({"--add-fixtures", "--control-socket", box.home.path() / "None"});
  EXPECT_EQ(absent.ending, exitedWith(EX_NOPERM)) << absent.errors;
  EXPECT_TRUE(contains(absent.errors, "start hapticd first"));
  const Finished unused = finishedWith({"--control-socket", box.home.controlSocket()});
  EXPECT_EQ(unused.ending, exitedWith(EX_USAGE)) << unused.errors;
}

TEST(ViewFixtureRight, IsBoundToATokenThatNoOtherUserCanRead) {
  const Box box;
  const TemporaryFolder folder;
  const fs::path token = folder.path() / "token";
  const auto makeToken = [&] {
    std::vector<std::string> options = box.adding();
    options.insert(options.end(), {"--make-token", "--token-file", token});
    return finishedWith(options);
  };
  EXPECT_EQ(makeToken().ending, exitedWith(0));
  EXPECT_EQ(static_cast<unsigned>(fs::status(token).permissions()), 0600U);
  EXPECT_EQ(makeToken().ending, exitedWith(0)) << "the file that is there is used";
  for (const unsigned mode : {0640U, 0604U}) {
    fs::permissions(token, fs::perms(mode));
    const Finished refused = makeToken();
    EXPECT_EQ(refused.ending, exitedWith(EX_CANTCREAT));
    EXPECT_TRUE(contains(refused.errors, "--token-file"));
  }
}

TEST(ViewFixtureRight, TakesTheTokenEvenWhereEverybodyMayLook) {
  const Box box({"control.depth_for_everyone=true"});
  BridgeUnderTest looking(box.home);
  EXPECT_TRUE(WebSocketPeer(looking.port(), "/live").isOpen());
  BridgeUnderTest adding(box.home, box.adding());
  EXPECT_TRUE(WebSocketPeer(adding.port(), "/live").answer().starts_with("HTTP/1.1 401"));
  EXPECT_TRUE(WebSocketPeer(adding.port(), adding.liveTarget()).isOpen());
}

constexpr const char* kAddNerve =
    R"({"type":"fixture","add":{"name":"nerve","kind":"sphere","position_m":[0,0,-2],"radius_m":0.02}})";
constexpr const char* kAddWrong =
    R"({"type":"fixture","add":{"name":"artery","kind":"sphere","position_m":[0,0,-2],"radius_m":-1}})";
constexpr const char* kRemoveNerve = R"({"type":"fixture","remove":"nerve"})";

/// The problem in the answer to a request, which is repeated while the bridge asks to wait.
std::string problemOf(WebSocketPeer& page, const std::string& request) {
  std::string problem = "(try again)";
  for (int tries = 0; tries < 1000 && problem.ends_with("(try again)"); ++tries) {
    page.sendText(request);
    problem = page.nextOf("fixture").value("problem", "no answer");
    std::this_thread::sleep_for(std::chrono::milliseconds(20));  // at most 100 messages a second
  }
  return problem;
}

/// Waits until the page has been told that the first fixture has this radius.
bool learnsRadius(WebSocketPeer& page, double radius_m) {
  for (int lists = 0; lists < 20; ++lists) {
    const json fixtures = page.nextOf("additions").value("fixtures", json::array());
    if (!fixtures.empty() && fixtures[0].at("definition").value("radius_m", 0.0) == radius_m) return true;
  }
  return false;
}

std::vector<std::string> namesIn(const DaemonHome& home) {
  const json reply = json::parse(home.control({"--json", "fixture", "list"}).output, nullptr, false);
  std::vector<std::string> names;
  for (const json& fixture : reply.value("fixtures", json::array()))
    names.push_back(fixture.value("name", ""));
  return names;
}

TEST(ViewFixtureRight, AddsAndRemovesWithTheChecksOfTheBox) {
  const Box box;
  box.home.control(
      {"fixture", "add", "vein", "--kind", "sphere", "--position-m", "0,0,-2.5", "--radius-m", "0.01"});
  BridgeUnderTest bridge(box.home, box.adding());
  WebSocketPeer page(bridge.port(), bridge.liveTarget());
  EXPECT_EQ(page.nextOf("hello", 1).value("addsFixtures", false), true);
  EXPECT_EQ(problemOf(page, kAddNerve), "");
  EXPECT_TRUE(contains(problemOf(page, kAddNerve), "same name"));
  EXPECT_TRUE(contains(problemOf(page, kAddWrong), "radius_m"));
  EXPECT_EQ(namesIn(box.home), (std::vector<std::string>{"vein", "nerve"}));
  EXPECT_EQ(problemOf(page, kRemoveNerve), "");
  EXPECT_EQ(namesIn(box.home), std::vector<std::string>{"vein"});
}

TEST(ViewFixtureRight, IsForNothingElse) {
  Box box;
  BridgeUnderTest bridge(box.home, box.adding());
  WebSocketPeer page(bridge.port(), bridge.liveTarget());
  const std::string before = box.home.control({"--json", "get"}).output;
  for (const char* text :
       {R"({"type":"engage"})", R"({"type":"fixture","engage":true})", R"({"type":"fixture","add":"all"})",
        R"({"type":"fixture","remove":["vein"]})", R"({"type":"set","parameters":{"force.radius_m":0.01}})",
        R"({"method":"io.hapticd.Control.Engage","parameters":{}})", R"({"type":"fixture"})"}) {
    page.sendText(text);
  }
  // what follows is answered after them
  EXPECT_EQ(problemOf(page, kAddNerve), "");
  EXPECT_EQ(box.home.control({"--json", "get"}).output, before);
  EXPECT_EQ(box.daemon.status().at("mode"), "idle");
  EXPECT_EQ(namesIn(box.home), std::vector<std::string>{"nerve"});
}

TEST(ViewFixtureRight, ReachesNoFixtureOfOthers) {
  const Box box;
  BridgeUnderTest bridge(box.home, box.adding());
  WebSocketPeer page(bridge.port(), bridge.liveTarget());
  WebSocketPeer other(bridge.port(), bridge.liveTarget());
  ASSERT_EQ(problemOf(page, kAddNerve), "");
  ASSERT_TRUE(learnsRadius(page, 0.02));
  EXPECT_TRUE(contains(problemOf(other, kRemoveNerve), "added here"));
  ASSERT_EQ(box.home.control({"fixture", "change", "nerve", "--radius-m", "0.03"}).ending, exitedWith(0));
  ASSERT_TRUE(learnsRadius(page, 0.03));
  EXPECT_TRUE(contains(problemOf(page, kRemoveNerve), "nobody has changed since"));
  EXPECT_TRUE(contains(box.home.control({"fixture", "list"}).output, "nerve"));
}

TEST(ViewFixtureRight, ReachesNothingThatReplacesItsFixtureBeforeItIsListed) {
  const Box box;
  BridgeUnderTest bridge(box.home, box.adding());
  WebSocketPeer page(bridge.port(), bridge.liveTarget());
  for (int i = 0; i < 6; ++i) {
    ASSERT_EQ(problemOf(page, kAddNerve), "");
    ASSERT_EQ(box.home
                  .control({"fixture", "add", "nerve", "--replace", "--kind", "sphere", "--position-m",
                            "0,0,-2", "--radius-m", i % 2 == 0 ? "0.02" : "0.03"})
                  .ending,
              exitedWith(0));
    const bool same = i % 2 == 0;  // a definition that is the same is the same fixture
    EXPECT_EQ(problemOf(page, kRemoveNerve).empty(), same);
    EXPECT_EQ(namesIn(box.home).size(), same ? 0U : 1U);
    box.home.control({"fixture", "remove", "nerve"});
  }
}

TEST(ViewFixtureRight, EndsWithTheConnectionOfThePage) {
  const Box box;
  BridgeUnderTest bridge(box.home, box.adding());
  {
    WebSocketPeer page(bridge.port(), bridge.liveTarget());
    ASSERT_EQ(problemOf(page, kAddNerve), "");
  }
  WebSocketPeer again(bridge.port(), bridge.liveTarget());
  EXPECT_TRUE(contains(problemOf(again, kRemoveNerve), "added here"));
}

TEST(ViewFixtureRight, LeavesALineInTheLogWhereItIsRefused) {
  const Box box;
  BridgeUnderTest looking(box.home);
  WebSocketPeer viewer(looking.port(), looking.liveTarget());
  EXPECT_EQ(viewer.nextOf("hello", 1).value("addsFixtures", true), false);
  viewer.sendText(kAddWrong);
  EXPECT_TRUE(looking.logs("a change of fixtures: nothing was changed: hapticd-view may not change the box"));
  BridgeUnderTest adding(box.home, box.adding());
  WebSocketPeer page(adding.port(), adding.liveTarget());
  page.sendText(kAddWrong);
  EXPECT_NE(page.nextOf("fixture").value("problem", ""), "");
  EXPECT_TRUE(adding.logs("a change of fixtures: "));
}

TEST(ViewFixtureRight, IsNotThatOfTheInstalledService) {
  for (const char* unit : {"systemd/hapticd-view.service.in", "systemd/hapticd-view.socket.in"}) {
    const std::string text = contentOf(fs::path(HAPTICD_SOURCE_FOLDER) / unit);
    EXPECT_FALSE(text.empty()) << unit;
    EXPECT_EQ(text.find("--add-fixtures"), std::string::npos) << unit;
  }
}

}  // namespace
}  // namespace hapticd::test
