// SPDX-License-Identifier: Apache-2.0
// The documented memory with the depth frames, read by the shipped example from a running daemon.
#include <gtest/gtest.h>

#include <regex>
#include <sstream>
#include <string>

#include "tests/system/daemon_under_test.h"

namespace hapticd::test {
namespace {

TEST(DepthShare, TheExampleInPythonGetsFramesInTheirOrder) {
  const DaemonHome home;
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  const Finished example =
      runToEnd({"/usr/bin/python3", HAPTICD_DEPTH_EXAMPLE, "--socket", home.statusSocket(), "--frames", "4"});
  ASSERT_EQ(example.ending, exitedWith(0)) << example.errors;

  const std::regex form(R"(frame (\d+): [\d.]+ ms old, ([\d.]+) % measured, ([\d.]+) to ([\d.]+) m)");
  std::istringstream lines(example.output);
  unsigned long newest = 0;
  int frames = 0;
  for (std::string line; std::getline(lines, line); ++frames) {
    std::smatch parts;
    ASSERT_TRUE(std::regex_match(line, parts, form)) << line;
    EXPECT_GT(std::stoul(parts[1]), newest);
    newest = std::stoul(parts[1]);
    EXPECT_GT(std::stod(parts[2]), 50);
    EXPECT_GT(std::stod(parts[3]), 0.3);
    EXPECT_LT(std::stod(parts[4]), 10);
  }
  EXPECT_EQ(4, frames);
}

}  // namespace
}  // namespace hapticd::test
