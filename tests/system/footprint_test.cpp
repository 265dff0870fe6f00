// SPDX-License-Identifier: Apache-2.0
// tools/footprint, which measures what hapticd takes of the computer that it runs on.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <regex>
#include <string>
#include <vector>

#include "tests/support/sanitizer.h"
#include "tests/system/support/daemon_under_test.h"

namespace hapticd::test {
namespace {

/// A busy machine may be late for what a box must not be late for.
const std::vector<std::string> kPatient{"--set", "safety.handle_timeout_s=1",
                                        "--set", "safety.overrun_burst=65",
                                        "--set", "safety.depth_timeout_s=5"};

Finished footprint(const std::vector<std::string>& arguments) {
  std::vector<std::string> command{"/usr/bin/python3", HAPTICD_FOOTPRINT, "--seconds", "0.5"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return runToEnd(command);
}

/// Runs it on the daemon of this build with the shipped configuration.
Finished footprintOfDaemon(std::vector<std::string> arguments) {
  arguments.insert(arguments.end(), {"--program", HAPTICD_PROGRAM, "--config", HAPTICD_CONFIGURATION});
  arguments.insert(arguments.end(), kPatient.begin(), kPatient.end());
  return footprint(arguments);
}

/// The text of the table that begins with this column, with the lines of its rows.
std::string tableOf(const std::string& output, const std::string& column) {
  const std::size_t begin = output.find("\n| " + column + " |");
  if (begin == std::string::npos) return "";
  return output.substr(begin, output.find("\n\n", begin) - begin);
}

/// The numbers in the first column of values.
std::vector<double> valuesOf(const std::string& table) {
  std::vector<double> values;
  const std::regex row("\\n\\|[^|]*\\| ([0-9.]+) ");
  for (std::sregex_iterator match(table.begin(), table.end(), row), end; match != end; ++match)
    values.push_back(std::stod((*match)[1]));
  return values;
}

TEST(Footprint, MeasuresEachStateOfADaemonThatItStarts) {
  const Finished run = footprintOfDaemon({"--most-mb", "100000"});
  ASSERT_EQ(exitedWith(0), run.ending) << run.errors;
  for (const char* title :
       {"from the start of the program to", "memory, MB", "resident part, MB", "MB per hour",
        "wake-ups per second", "preemptions per second", "CPU, ms per second"}) {
    EXPECT_NE(std::string::npos, run.output.find(fmt::format("| {} | idle | engaged | trace |\n", title)))
        << title << " in\n"
        << run.output;
  }
  const std::string wake_ups = tableOf(run.output, "wake-ups per second");
  for (const char* thread : {"hapticd-force", "hapticd-scene", "hapticd-trace", "handle", "camera"}) {
    EXPECT_NE(std::string::npos, wake_ups.find(fmt::format("| `{}` | ", thread))) << wake_ups;
  }
}

TEST(Footprint, ThePartsAreTheWhole) {
  const Finished run = footprintOfDaemon({"--states", "idle", "--most-mb", "100000"});
  ASSERT_EQ(exitedWith(0), run.ending) << run.errors;
  const std::vector<double> memory = valuesOf(tableOf(run.output, "memory, MB"));
  const std::vector<double> parts = valuesOf(tableOf(run.output, "resident part, MB"));
  ASSERT_FALSE(memory.empty()) << run.output;
  ASSERT_GT(parts.size(), 3U) << run.output;
  double sum = 0;
  for (const double part : parts) sum += part;
  // Each part is rounded to 0.1 MB, and the kernel counts VmRSS per CPU: up to 64 pages of each are missing.
  EXPECT_NEAR(memory.front(), sum, 0.05 * static_cast<double>(parts.size() + 1) + 3) << run.output;
}

TEST(Footprint, AnIdleDaemonTakesAtMost64MB) {
  if (kMemoryOfSanitizer) GTEST_SKIP() << "a sanitizer takes memory of its own";
  const Finished run = footprintOfDaemon({"--states", "idle"});
  EXPECT_EQ(exitedWith(0), run.ending) << run.errors << run.output;
}

TEST(Footprint, SaysWhatIsTooLarge) {
  const Finished run = footprintOfDaemon({"--states", "idle", "--most-mb", "1"});
  EXPECT_EQ(exitedWith(1), run.ending);
  EXPECT_TRUE(std::regex_search(run.errors, std::regex("idle: [0-9.]+ MB are resident, more than 1 MB")))
      << run.errors;
}

TEST(Footprint, MeasuresARunningDaemon) {
  const DaemonHome home;
  Daemon daemon(home);
  ASSERT_TRUE(daemon.answers());
  const Finished run = footprint({"--pid", fmt::to_string(daemon.pid()), "--most-mb", "100000"});
  ASSERT_EQ(exitedWith(0), run.ending) << run.errors;
  EXPECT_NE(std::string::npos, run.output.find(fmt::format("| memory, MB | process {} |", daemon.pid())))
      << run.output;
  EXPECT_TRUE(daemon.ticks()) << "the daemon still runs";
}

TEST(Footprint, RefusesWhatItCannotMeasure) {
  const auto expectRefusal = [](const std::vector<std::string>& arguments, const std::string& reason) {
    const Finished run = footprint(arguments);
    EXPECT_EQ(exitedWith(2), run.ending) << run.output;
    EXPECT_NE(std::string::npos, run.errors.find(reason)) << run.errors;
  };
  expectRefusal({"--pid", "99999999"}, "--pid 99999999: there is no such process");
  expectRefusal({"--states", "asleep"}, "asleep is none of idle, engaged, trace");
  expectRefusal({"--seconds", "0"}, "0 is not a number between 0.1 and 86400");
  expectRefusal({"--program", "/nonexistent", "--config", HAPTICD_CONFIGURATION},
                "/nonexistent cannot be started");
  expectRefusal({"--program", HAPTICD_PROGRAM, "--config", "/nonexistent.yaml"},
                "--config /nonexistent.yaml");
  expectRefusal({"--program", HAPTICD_PROGRAM, "--config", HAPTICD_CONFIGURATION, "--set", "loop.rate_hz=5"},
                "hapticd ended; its log is:");
}

}  // namespace
}  // namespace hapticd::test
