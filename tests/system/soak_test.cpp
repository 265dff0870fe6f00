// SPDX-License-Identifier: Apache-2.0
// haptic-soak on the built daemon, for a few seconds.

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/system/daemon_under_test.h"

namespace hapticd {
namespace {

using nlohmann::json;
using test::contains;
using test::exitedWith;
using test::Finished;

class Soak : public testing::Test {
 protected:
  Finished soak(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(),
                     {HAPTIC_SOAK_PROGRAM, "--seed", "1", "--config", folder_.path() / "box.yaml"});
    return test::runToEnd(arguments);
  }

  const test::TemporaryFolder folder_;
  const std::filesystem::path config_ = folder_.write("box.yaml", test::kWallYaml);
};

TEST_F(Soak, OfAFewSecondsKeepsAllLimitsAndShowsThem) {
  const std::string report = folder_.path() / "soak.json";
  // The flight recorder is full before the memory is looked at.
  const Finished finished = soak({"--seconds", "6", "--set", "trace.flight_recorder_s=2", "--json", report});
  EXPECT_EQ(finished.ending, exitedWith(0)) << finished.output << finished.errors;
  EXPECT_TRUE(contains(finished.output, "--seed 1\n"));
  EXPECT_TRUE(contains(finished.output, "ticks lost between the loop and the trace"));
  EXPECT_TRUE(contains(finished.output, "all limits kept"));

  std::ifstream file(report);
  const json document = json::parse(file);
  EXPECT_GT(document.at("samples").size(), 10U);
  EXPECT_GT(document.at("reloads"), 0);
  EXPECT_GT(document.at("status").at("loop").at("counters").at("ticks"), 0);
  for (const json& finding : document.at("findings"))
    EXPECT_EQ(finding.at("broken"), false) << finding.dump();
}

TEST_F(Soak, ComparesLoadsInTurns) {
  const std::string report = folder_.path() / "loads.json";
  const Finished finished = soak({"--compare-loads", "--rounds", "2", "--round", "1", "--clients", "5",
                                  "--set", "trace.min_free_mb=0", "--json", report});
  ASSERT_EQ(finished.ending, exitedWith(0)) << finished.output << finished.errors;
  std::ifstream file(report);
  const json document = json::parse(file);
  std::vector<std::string> loads;
  for (const json& round : document.at("rounds")) {
    loads.push_back(round.at("load"));
    EXPECT_GT(round.at("ticks"), 0);
    EXPECT_GT(round.at("wakeupP999Us"), 0);
  }
  EXPECT_EQ(loads,
            (std::vector<std::string>{"none", "hammering", "tracing", "none", "hammering", "tracing"}));
  EXPECT_GT(document.at("calls"), 10);
  EXPECT_EQ(document.at("unanswered"), 0);
  EXPECT_EQ(document.at("status").at("trace").at("traces"), 2);
  EXPECT_GT(document.at("traceBytesPerHour"), 0);
}

// How long things take under the flood is for a machine of its own; that they are done, and that no tick is
// lost, holds everywhere.
TEST_F(Soak, OfAFloodLosesNoTickAndDisengagesEachTime) {
  const std::string report = folder_.path() / "flood.json";
  const Finished finished =
      soak({"--flood", "--seconds", "3", "--max-gap-s", "60", "--max-disengage-s", "60", "--json", report});
  ASSERT_EQ(finished.ending, exitedWith(0)) << finished.output << finished.errors;
  EXPECT_TRUE(contains(finished.output, "longest wait of the watchdog"));
  std::ifstream file(report);
  const json document = json::parse(file);
  EXPECT_GT(document.at("status").at("control").at("longestGapNs"), 0);
  EXPECT_GT(document.at("disengageS").size(), 0U);
}

TEST_F(Soak, FailsWithTheLimitThatIsBroken) {
  const Finished finished = soak({"--seconds", "1", "--max-memory-kb", "1"});
  EXPECT_EQ(finished.ending, exitedWith(1));
  EXPECT_TRUE(contains(finished.output, "1  BROKEN"));
  EXPECT_TRUE(contains(finished.output, "1 limits broken"));
}

TEST_F(Soak, FailsWhenTheDaemonDoesNotLive) {
  const Finished finished =
      soak({"--seconds", "60", "--on-replug", "kill -KILL $HAPTICD_PID", "--replug-every", "0.5"});
  EXPECT_EQ(finished.ending, exitedWith(1));
  EXPECT_TRUE(contains(finished.output, "hapticd ended by itself: signal 9"));
}

TEST_F(Soak, RunsTheReplugCommandAgainAndAgain) {
  const std::string marks = folder_.path() / "marks";
  const Finished finished =
      soak({"--seconds", "2", "--on-replug", "echo mark >>" + marks, "--replug-every", "0.2"});
  EXPECT_EQ(finished.ending, exitedWith(0)) << finished.output << finished.errors;
  std::ifstream file(marks);
  int count = 0;
  for (std::string line; std::getline(file, line);) ++count;
  EXPECT_GT(count, 1);
}

TEST_F(Soak, SaysWhyTheDaemonDoesNotStart) {
  const Finished finished = soak({"--seconds", "1", "--set", "camera.driver=none"});
  EXPECT_EQ(finished.ending, exitedWith(69));
  EXPECT_TRUE(contains(finished.errors, "camera.driver"));
}

TEST_F(Soak, RefusesWrongUsage) {
  EXPECT_EQ(soak({"--seconds", "0"}).ending, exitedWith(64));
  EXPECT_EQ(soak({"--seconds", "1", "--minutes", "1"}).ending, exitedWith(64));
  EXPECT_EQ(soak({"--flood", "--compare-loads"}).ending, exitedWith(64));
  EXPECT_EQ(soak({"--connections", "4"}).ending, exitedWith(64));
  EXPECT_EQ(test::runToEnd({HAPTIC_SOAK_PROGRAM}).ending, exitedWith(64));
}

}  // namespace
}  // namespace hapticd
