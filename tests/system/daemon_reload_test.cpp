// SPDX-License-Identifier: Apache-2.0
// SIGHUP to a running hapticd: the configuration file is read again.

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>

#include "tests/system/support/daemon_under_test.h"

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
  // the value is in force a moment before it is logged
  EXPECT_TRUE(test::becomesTrue([&] {
    return daemon.errors().find("reload sets force.stiffness_n_per_m from 500 to 321") != std::string::npos;
  })) << daemon.errors();
  EXPECT_TRUE(daemon.ticks());
}

TEST_F(DaemonReload, ReportsWhatWaitsForTheNextStartUntilItIsTakenBack) {
  reload("loop: {priority: 70}\n");
  EXPECT_TRUE(warns("loop.priority"));
  reload("");
  EXPECT_TRUE(daemon.reaches([](const nlohmann::json& status) {
    return status.at("warnings").dump().find("loop.priority") == std::string::npos;
  }));
}

TEST_F(DaemonReload, OfAFileThatHasGoneChangesNothing) {
  std::filesystem::remove(home.path() / "hapticd.yaml");
  daemon.signal(SIGHUP);
  EXPECT_TRUE(warns("not reloaded"));
  EXPECT_TRUE(daemon.ticks());
}

class DaemonReloadWhileEngaged : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(daemon.answers());
    ASSERT_TRUE(daemon.reaches([](const nlohmann::json& status) { return status.at("mode") == "engaged"; }));
    ASSERT_EQ(home.control({"fixture", "add", "vessel", "--kind", "sphere", "--position-m", "0,0,-1",
                            "--radius-m", "0.01"})
                  .ending,
              exitedWith(0));
  }

  void write(const std::string& text) { home.command(kWallYaml + text); }
  std::string limit() { return home.control({"get", "safety.max_force_n"}).output; }
  /// "name origin" of each fixture.
  std::vector<std::string> fixtures() {
    const nlohmann::json reply = nlohmann::json::parse(home.control({"--json", "fixture", "list"}).output);
    std::vector<std::string> names;
    for (const auto& fixture : reply.at("fixtures"))
      names.push_back(fixture.at("name").get<std::string>() + " " + fixture.at("origin").get<std::string>());
    return names;
  }

  using Names = std::vector<std::string>;
  const DaemonHome home;
  Daemon daemon{home,
                kWallYaml + std::string("fixtures: [{name: nerve, kind: sphere, position_m: [0, 0, -1], "
                                        "radius_m: 0.01}]\n"),
                {"control.engage_at_start=true"}};
};

// The group safety of the wall is in the file's first lines; a limit is set by a client here.
TEST_F(DaemonReloadWhileEngaged, KeepsWhatProtectsUntilAPersonConfirms) {
  ASSERT_EQ(home.control({"set", "safety.max_force_n=3"}).ending, exitedWith(0));
  write("force: {radius_m: 0.03}\n");
  daemon.signal(SIGHUP);
  ASSERT_TRUE(
      daemon.reaches([](const nlohmann::json& status) { return status.at("pendingReload").is_object(); }));
  EXPECT_EQ(limit(), "safety.max_force_n = 3 N\n");
  EXPECT_EQ(fixtures(), (Names{"nerve configuration", "vessel client"}));
  EXPECT_EQ(home.control({"get", "force.radius_m"}).output, "force.radius_m = 0.03 m\n")
      << "the rest is there";
  const std::string warnings = daemon.status().at("warnings").dump();
  EXPECT_TRUE(contains(warnings, "safety.max_force_n from 3 to 4 N; fixture nerve is removed"));
  EXPECT_TRUE(contains(daemon.errors(), "reload does not loosen while the box is engaged: "));

  const test::Finished confirmed = home.control({"reload", "--confirm"});
  EXPECT_EQ(confirmed.ending, exitedWith(0)) << confirmed.errors;
  EXPECT_TRUE(contains(confirmed.output,
                       "confirmed:\n  safety.max_force_n from 3 to 4 N\n"
                       "  fixture nerve is removed\n"));
  EXPECT_EQ(limit(), "safety.max_force_n = 4 N\n");
  EXPECT_EQ(fixtures(), Names{"vessel client"});
  EXPECT_TRUE(daemon.status().at("pendingReload").is_null());
  EXPECT_EQ(home.control({"reload", "--confirm"}).ending, exitedWith(1)) << "nothing waits any more";
}

TEST_F(DaemonReloadWhileEngaged, FollowsWhenTheBoxIsDisengaged) {
  write("");
  const test::Finished held = home.control({"reload"});
  EXPECT_EQ(held.ending, exitedWith(1));
  EXPECT_TRUE(contains(held.output, "held back, because the box is engaged:\n  fixture nerve is removed\n"));
  EXPECT_EQ(fixtures(), (Names{"nerve configuration", "vessel client"}));
  ASSERT_EQ(home.control({"disengage"}).ending, exitedWith(0));
  EXPECT_TRUE(test::becomesTrue([this] { return fixtures() == Names{"vessel client"}; }));
  EXPECT_TRUE(daemon.status().at("pendingReload").is_null());
}

TEST_F(DaemonReloadWhileEngaged, SaysWhatItChangedAndWhyItIsRefused) {
  write(
      "fixtures: [{name: nerve, kind: sphere, position_m: [0, 0, -1], radius_m: 0.01}]\nforce: {radius_m: "
      "0.03}\n"
      "loop: {priority: 70}\n");
  const test::Finished done = home.control({"reload"});
  EXPECT_EQ(done.ending, exitedWith(0)) << done.output;
  EXPECT_EQ(done.output,
            "1 change\n  sets force.radius_m from 0.04 to 0.03\n"
            "at the next start only (systemctl restart hapticd):\n  loop.priority\n");
  write("force: {radius_m: 99}\n");
  const test::Finished refused = home.control({"reload"});
  EXPECT_EQ(refused.ending, exitedWith(1));
  EXPECT_TRUE(contains(refused.errors, "nothing was changed: the configuration cannot be used\n  "));
  EXPECT_TRUE(contains(refused.errors, "hapticd.yaml:5: force.radius_m: "));
}

// Absence is no consent to more force and less protection.
TEST_F(DaemonReload, OfAnEmptyFileKeepsLimitsAndForbiddenRegions) {
  const std::string protection =
      "safety: {max_force_n: 1}\n"
      "fixtures: [{name: nerve, kind: sphere, position_m: [0, 0, -1], radius_m: 0.01}]\n";
  home.command(protection);
  daemon.signal(SIGHUP);
  const auto isProtected = [this] {
    return home.control({"get", "safety.max_force_n"}).output == "safety.max_force_n = 1 N\n" &&
           home.control({"fixture", "list"}).output.find("nerve") != std::string::npos;
  };
  ASSERT_TRUE(test::becomesTrue(isProtected));
  home.command("");
  daemon.signal(SIGHUP);
  EXPECT_TRUE(warns("not reloaded"));
  EXPECT_TRUE(warns("has no group of parameters"));
  EXPECT_TRUE(isProtected());
}

TEST_F(DaemonReload, ManyTimesInARowLeavesTheLoopRunning) {
  for (int round = 0; round < 50; ++round) daemon.signal(SIGHUP);
  reload("force: {stiffness_n_per_m: 322}\n");
  EXPECT_TRUE(stiffnessBecomes("322"));
  EXPECT_TRUE(daemon.ticks());
}

// Opening a pipe would wait for its writer, and nobody would feed the watchdog or answer.
TEST_F(DaemonReload, OfAFileThatHasBecomeAPipeIsRefusedAndTheDaemonGoesOnAnswering) {
  const std::filesystem::path file = home.path() / "hapticd.yaml";
  std::filesystem::remove(file);
  ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0);
  daemon.signal(SIGHUP);
  EXPECT_TRUE(warns("not reloaded"));
  EXPECT_TRUE(warns("is not a regular file"));
  EXPECT_TRUE(daemon.ticks());
  std::filesystem::remove(file);
  reload("force: {stiffness_n_per_m: 321}\n");
  EXPECT_TRUE(stiffnessBecomes("321"));
}

TEST_F(DaemonReload, SaysWhatTheFileSetsAndWhatDiffersFromTheDefaults) {
  reload("force: {stiffness_n_per_m: 321}\n");
  ASSERT_TRUE(stiffnessBecomes("321"));
  const auto said = [this](const std::string& text) {
    return test::becomesTrue([&] { return daemon.errors().find(text) != std::string::npos; });
  };
  EXPECT_TRUE(said(", force.stiffness_n_per_m = 321 (default 500), "));
}

// The depth unit of the running camera is fixed: a law that reaches farther than it holds is refused.
TEST(DaemonWithAFineDepthUnit, RefusesALawThatReachesTooFarAndSaysWhatToDo) {
  const DaemonHome home;
  Daemon daemon(
      home, "camera: {driver: synthetic, unit_um: 80}\nsynthetic: {camera: stereo}\nforce: {law: surface}\n");
  ASSERT_TRUE(daemon.answers());
  const test::Finished finished = home.control({"set", "force.law=proxy"});
  EXPECT_NE(finished.ending, exitedWith(0));
  EXPECT_TRUE(contains(finished.errors, "the law proxy needs 0.192 m"));
  EXPECT_TRUE(contains(finished.errors, "set camera.unit_um to at least 94"));
}

}  // namespace
}  // namespace hapticd
