// SPDX-License-Identifier: Apache-2.0
// A real box seen through a real bridge by a client of the Foxglove protocol that is not of this project.
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <regex>
#include <string>

#include "tests/support/file_content.h"
#include "tests/system/support/daemon_under_test.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;

/// The address that the bridge prints; "" if it ends first.
std::string addressOf(Program& bridge) {
  std::smatch match;
  std::string output;
  const bool printed = becomesTrue([&] {
    output = bridge.output();
    return std::regex_search(output, match, std::regex("listens at (\\S+)\n")) || !bridge.running();
  });
  return printed && !match.empty() ? match[1].str() : "";
}

TEST(FoxgloveClient, DecodesEveryChannelOfARunningBoxAndItsTicksAreThoseOfTheTrace) {
  if (fs::exists(NOT_INSTALLED)) GTEST_SKIP() << contentOf(NOT_INSTALLED);
  const DaemonHome home;
  Daemon daemon(
      home, std::string(kWallYaml) + "trace: {at_start: true, depth: true, scene: cloud, min_free_mb: 0}\n");
  ASSERT_TRUE(daemon.answers());
  const Finished engaged = home.control({"engage"});
  ASSERT_EQ(engaged.ending, exitedWith(0)) << engaged.errors;

  Program bridge({HAPTICD_VIEW_PROGRAM, "--socket", home.statusSocket(), "--listen", "127.0.0.1:0",
                  "--no-token", "--page", VIEW_PAGE});
  const std::string address = addressOf(bridge);
  ASSERT_FALSE(address.empty()) << bridge.errors();
  const fs::path ticks = home.path() / "ticks.json";
  const Finished look = runToEnd({NODE_PROGRAM, LOOK, "ws://" + address + "/", ticks.string()});
  ASSERT_EQ(look.ending, exitedWith(0)) << look.errors << bridge.errors();

  EXPECT_EQ(daemon.terminate(), exitedWith(0));
  const fs::path trace = *fs::directory_iterator(home.traceFolder());
  const Finished compare = runToEnd({NODE_PROGRAM, COMPARE, ticks.string(), trace.string()});
  EXPECT_EQ(compare.ending, exitedWith(0)) << compare.errors;
  bridge.signal(SIGTERM);
  EXPECT_EQ(bridge.wait(), exitedWith(0)) << bridge.errors();
}

}  // namespace
}  // namespace hapticd::test
