// SPDX-License-Identifier: Apache-2.0
// The documented stream of ticks, read by the shipped example from a running daemon.
#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

#include "tests/system/daemon_under_test.h"

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

}  // namespace
}  // namespace hapticd::test
