// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "tests/system/support/daemon_under_test.h"

// The documented stream of ticks, read by the shipped example from a running daemon.
namespace hapticd::test {
namespace {

std::vector<std::string> cellsOf(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream text(line);
  for (std::string cell; std::getline(text, cell, ',');) {
    if (!cell.empty() && cell.back() == '\r') cell.pop_back();
    cells.push_back(cell);
  }
  return cells;
}

TEST(TickStream, TheExampleInPythonGetsEveryTickOrCountsIt) {
  const DaemonHome home;
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  const Finished example =
      runToEnd({"/usr/bin/python3", HAPTICD_TICKS_EXAMPLE, "--socket", home.statusSocket(), "--seconds", "1",
                "number", "mode", "hip_m_in_world"});
  ASSERT_EQ(example.ending, exitedWith(0)) << example.errors;

  std::istringstream lines(example.output);
  std::string line;
  ASSERT_TRUE(std::getline(lines, line));
  EXPECT_EQ(cellsOf(line), (std::vector<std::string>{"number", "mode", "hip_m_in_world_x", "hip_m_in_world_y",
                                                     "hip_m_in_world_z"}));
  std::vector<long> numbers;
  while (std::getline(lines, line)) {
    const std::vector<std::string> cells = cellsOf(line);
    ASSERT_EQ(cells.size(), 5U) << line;
    const long number = std::stol(cells[0]);
    EXPECT_GT(number, numbers.empty() ? 0 : numbers.back());
    numbers.push_back(number);
    EXPECT_EQ(cells[1], "idle");
  }
  ASSERT_FALSE(numbers.empty());
  const long missing = numbers.back() - numbers.front() + 1 - static_cast<long>(numbers.size());
  EXPECT_NE(example.errors.find(std::to_string(missing) + " ticks lost"), std::string::npos)
      << example.errors;
}

TEST(TickStream, TheExampleInPythonReportsAFieldThatTicksDoNotHave) {
  const DaemonHome home;
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  const Finished example = runToEnd({"/usr/bin/python3", HAPTICD_TICKS_EXAMPLE, "force"},
                                    {.environment = {"HAPTICD_SOCKET=" + home.controlSocket()}});
  EXPECT_EQ(example.ending, exitedWith(1));
  EXPECT_NE(example.errors.find("io.hapticd.Status.UnknownField"), std::string::npos) << example.errors;
}

// The documented memory with the depth frames, read by the shipped example from a running daemon.

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
