// SPDX-License-Identifier: Apache-2.0
#include "daemon/stop_guard.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sysexits.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <string>

#include "daemon/journal.h"
#include "drivers/base/stop_signal.h"

namespace hapticd::daemon {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kLong = std::chrono::minutes(10);

TEST(StopGuard, LetsAPartStopThatDoes) {
  bool stopped = false;
  stopWithin(
      "the handle", kLong, [&] { stopped = true; },
      [](const std::string& part, milliseconds) { ADD_FAILURE() << part << " was given up"; });
  EXPECT_TRUE(stopped);
}

TEST(StopGuard, GivesAPartUpThatHangs) {
  drivers::StopSignal given_up;
  std::string part;
  stopWithin(
      "the camera", milliseconds(1),
      [&] { EXPECT_TRUE(given_up.waitUntil(std::chrono::steady_clock::now() + std::chrono::minutes(1))); },
      [&](const std::string& name, milliseconds limit) {
        part = name;
        EXPECT_EQ(limit, milliseconds(1));
        given_up.raise();
      });
  EXPECT_EQ(part, "the camera");
}

TEST(StopGuardDeathTest, EndsTheProcessWithoutAPartThatHangs) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto hang = [] {
    drivers::StopSignal never;
    never.waitUntil(std::chrono::steady_clock::now() + kLong);
  };
  EXPECT_EXIT(stopWithin("the camera", milliseconds(1500), hang), testing::ExitedWithCode(EX_SOFTWARE),
              "the camera does not stop within 1.5 s: the daemon ends without it");
}

TEST(StopGuardDeathTest, EndsTheProcessThoughNobodyReadsItsLog) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto end_with_full_pipe = [] {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_NONBLOCK) != 0) return;
    while (::write(ends[1], "x", 1) == 1) continue;
    ::fcntl(ends[1], F_SETFL, 0);
    const auto journal = JournalThread::start();
    ::dup2(ends[1], STDERR_FILENO);
    endWithout("the camera", milliseconds(1500));
  };
  EXPECT_EXIT(end_with_full_pipe(), testing::ExitedWithCode(EX_SOFTWARE), "");
}

TEST(StopLimits, FitIntoWhatTheUnitAllows) {
  std::ifstream unit(HAPTICD_SOURCE_FOLDER "/systemd/hapticd.service.in");
  const std::string key = "TimeoutStopSec=";
  int allowed_s = 0;
  for (std::string line; std::getline(unit, line);) {
    if (line.starts_with(key)) allowed_s = std::stoi(line.substr(key.size()));
  }
  EXPECT_GT(allowed_s, StopLimits::kAll.count());
}

}  // namespace
}  // namespace hapticd::daemon
