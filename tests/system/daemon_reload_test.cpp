// SIGHUP to a running hapticd: the configuration file is read again.

#include <gtest/gtest.h>
#include <signal.h>

#include "tests/system/daemon_under_test.h"

namespace hapticd {
namespace {

using test::contains;
using test::Daemon;
using test::DaemonHome;
using test::exitedWith;
using test::kWallYaml;

class DaemonReload : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(daemon.answers()); }

  /// Writes the configuration, so that `text` is added to what the daemon was started with, and signals.
  void reload(const std::string& text) {
    home.command(kWallYaml + text);
    daemon.signal(SIGHUP);
  }
  bool warns(const std::string& text) {
    return daemon.reaches([&](const nlohmann::json& status) {
      return status.at("warnings").dump().find(text) != std::string::npos;
    });
  }
  std::string stiffness() { return home.control({"get", "force.stiffness_n_per_m"}).output; }
  bool stiffnessBecomes(const std::string& value) {
    return test::becomesTrue([&] { return stiffness() == "force.stiffness_n_per_m = " + value + " N/m\n"; });
  }

  const DaemonHome home;
  Daemon daemon{home};
};

TEST_F(DaemonReload, AppliesLiveParameters) {
  reload("force: {stiffness_n_per_m: 321}\n");
  EXPECT_TRUE(stiffnessBecomes("321"));
  EXPECT_TRUE(contains(daemon.errors(), "reload sets force.stiffness_n_per_m from 500 to 321"));
  EXPECT_TRUE(daemon.ticks());
}

TEST_F(DaemonReload, TakesBackWhatAClientHasSet) {
  ASSERT_EQ(home.control({"set", "force.stiffness_n_per_m=400"}).ending, exitedWith(0));
  reload("");
  EXPECT_TRUE(stiffnessBecomes("500"));
}

TEST_F(DaemonReload, ReportsWhatWaitsForTheNextStartUntilItIsTakenBack) {
  reload("loop: {priority: 70}\n");
  EXPECT_TRUE(warns("loop.priority"));
  reload("");
  EXPECT_TRUE(daemon.reaches([](const nlohmann::json& status) {
    return status.at("warnings").dump().find("loop.priority") == std::string::npos;
  }));
}

TEST_F(DaemonReload, OfABadFileChangesNothingAndNamesTheLineAndTheValue) {
  reload("force: {stiffness_n_per_m: 99999}\n");
  EXPECT_TRUE(warns("not reloaded"));
  EXPECT_TRUE(warns("99999"));
  EXPECT_TRUE(warns("hapticd.yaml:5"));
  EXPECT_TRUE(stiffnessBecomes("500"));
  EXPECT_TRUE(daemon.ticks());
}

TEST_F(DaemonReload, OfAFileThatHasGoneChangesNothing) {
  std::filesystem::remove(home.path() / "hapticd.yaml");
  daemon.signal(SIGHUP);
  EXPECT_TRUE(warns("not reloaded"));
  EXPECT_TRUE(daemon.ticks());
}

TEST_F(DaemonReload, ManyTimesInARowLeavesTheLoopRunning) {
  for (int round = 0; round < 50; ++round) daemon.signal(SIGHUP);
  reload("force: {stiffness_n_per_m: 322}\n");
  EXPECT_TRUE(stiffnessBecomes("322"));
  EXPECT_TRUE(daemon.ticks());
}

}  // namespace
}  // namespace hapticd
