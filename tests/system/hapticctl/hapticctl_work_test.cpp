// SPDX-License-Identifier: Apache-2.0
// What the commands of hapticctl do, print and write.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "tests/system/support/daemon_under_test.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class HapticctlWork : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(daemon.answers());
    ASSERT_TRUE(daemon.reaches([](const json& status) { return status["tick"]["pointsUsed"] == 100; }));
  }

  std::string file(const std::string& name) const { return home.path() / name; }
  std::string output(const std::vector<std::string>& arguments) const {
    const Finished finished = home.control(arguments);
    EXPECT_EQ(finished.ending, exitedWith(0)) << finished.errors;
    return finished.output;
  }
  json reply(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "--json");
    return json::parse(output(arguments));
  }
  std::string refusal(const std::vector<std::string>& arguments) const {
    const Finished refused = home.control(arguments);
    EXPECT_EQ(refused.ending, exitedWith(1)) << refused.output;
    return refused.errors;
  }
  /// Writes a trace and returns its name.
  std::string makeTrace(const std::string& label) const {
    output({"trace", "start", "--label", label});
    const std::string written = output({"trace", "stop"});
    return written.substr(written.find(' ') + 1, written.find('\n') - written.find(' ') - 1);
  }

  const DaemonHome home;
  Daemon daemon{home};
};

// --- traces and profiles

TEST_F(HapticctlWork, ATraceIsWrittenMarkedNotedKeptAndDeleted) {
  EXPECT_TRUE(output({"trace", "start", "--label", "demo"}).ends_with("-demo\n"));
  EXPECT_TRUE(contains(output({"trace", "mark", "trial 3"}), ": trial 3\n"));
  EXPECT_TRUE(contains(output({"trace", "list", "--state", "writing"}), "being written"));
  output({"trace", "stop"});
  const std::string name = [this] {
    const std::string line = output({"trace", "list", "--names"});
    return line.substr(0, line.find('\n'));
  }();
  EXPECT_EQ(output({"trace", "note", name, "participant 7"}), "noted for " + name + ": participant 7\n");
  output({"trace", "keep", name});
  const json listed = reply({"trace", "list"})["traces"][0];
  EXPECT_EQ(listed["note"], "participant 7");
  EXPECT_EQ(listed["kept"], true);
  EXPECT_TRUE(contains(refusal({"trace", "delete", name}), "keep --undo " + name));
  EXPECT_EQ(output({"trace", "note", name, ""}), "removed the note of " + name + "\n");
  output({"trace", "keep", "--undo", name});
  EXPECT_EQ(output({"trace", "delete", name}), "deleted " + name + "\n");
  EXPECT_EQ(output({"trace", "list", "--names"}), "");
  const Finished bad = home.control({"trace", "list", "--since", "yesterday"});
  EXPECT_EQ(bad.ending, exitedWith(2));
  EXPECT_TRUE(contains(bad.errors, "hapticctl: --since: \"yesterday\" is neither a time in UTC"));
  EXPECT_TRUE(contains(bad.errors, "Run 'hapticctl trace list --help' for more information."));
}

TEST_F(HapticctlWork, SeveralTracesAreDeletedOnlyWhenConfirmed) {
  const std::string old = makeTrace("old");
  const std::string older = makeTrace("older");
  const std::string mine = makeTrace("mine");
  output({"trace", "keep", mine});
  output({"trace", "start", "--label", "now"});
  const auto count = [this] { return reply({"trace", "list"})["traces"].size(); };
  const std::vector<std::string> by_age{"trace", "delete", "--older-than", "0s"};
  const Finished refused = home.controlWithInput("n\n", by_age);
  EXPECT_EQ(refused.ending, exitedWith(1));
  for (const std::string& said : {mine + " stays", std::string("-now stays"), std::string("2 traces, "),
                                  std::string("delete them? [y/N]"), std::string("nothing was deleted")})
    EXPECT_TRUE(contains(refused.errors, said));
  EXPECT_EQ(home.controlWithInput("", {"trace", "delete", old, older}).ending, exitedWith(1));
  const std::string kept = refusal({"trace", "delete", "--yes", old, mine, "none"});
  EXPECT_TRUE(contains(kept, mine + " is kept (hapticctl trace keep --undo " + mine + ")"));
  EXPECT_TRUE(contains(kept, "none: there is no such trace"));
  EXPECT_EQ(count(), 4U);

  EXPECT_EQ(home.controlWithInput("y\n", {"trace", "delete", old, older}).ending, exitedWith(0));
  EXPECT_EQ(count(), 2U);
  EXPECT_EQ(home.control({"trace", "delete"}).ending, exitedWith(2));
  EXPECT_EQ(home.control({"trace", "delete", mine, "--older-than", "1d"}).ending, exitedWith(2));
}

TEST_F(HapticctlWork, TraceFilesAreLookedForByNameInTheFolderOfTheDaemon) {
  const std::string name = makeTrace("mine");
  EXPECT_TRUE(contains(output({"trace", "info", name}), "\nticks "));
  EXPECT_TRUE(contains(refusal({"trace", "info", "nothing"}), home.traceFolder() / "nothing.mcap"));
  EXPECT_TRUE(contains(refusal({"trace", "info", "/no/such.mcap"}), "/no/such.mcap"));
}

TEST_F(HapticctlWork, NumbersMayHaveAUnit) {
  EXPECT_EQ(output({"set", "force.stiffness_n_per_m=0.8N/mm", "force.radius_m=30 mm"}),
            "force.stiffness_n_per_m: 500 -> 800 N/m\nforce.radius_m: 0.04 -> 0.03 m\n");
  const auto wrong = home.control({"set", "force.stiffness_n_per_m=800kg"});
  EXPECT_EQ(wrong.ending, exitedWith(2));
  EXPECT_TRUE(
      contains(wrong.errors,
               "force.stiffness_n_per_m: \"800kg\": \"kg\" is not a unit that it takes; write the number in "
               "N/m, or with N/mm"));
}

TEST_F(HapticctlWork, ParametersAreFoundByWordsOfTheirMeaning) {
  const std::string found = output({"params", "Noticeable", "error"});
  EXPECT_TRUE(contains(found, "force.max_error_n"));
  EXPECT_FALSE(contains(found, "force.radius_m"));
  EXPECT_TRUE(contains(refusal({"params", "no-such-word"}), "no-such-word"));
  EXPECT_TRUE(contains(refusal({"get", "Noticeable"}), "Noticeable")) << "only params searches";
}

TEST_F(HapticctlWork, ProfilesAreSavedLoadedDeletedAndChosen) {
  EXPECT_EQ(output({"save", "soft"}), "saved soft\n");
  output({"set", "force.radius_m=0.03"});
  EXPECT_TRUE(
      contains(refusal({"save", "soft"}), "exists already ('hapticctl save --force soft' replaces it)"));
  EXPECT_EQ(output({"load", "soft"}), "loaded; changed:\n  force.radius_m\n");
  EXPECT_EQ(output({"save", "soft", "--force"}), "saved soft\n");
  output({"profiles", "--boot", "soft"});
  EXPECT_TRUE(contains(output({"profiles"}), "loaded at each start\n"));
  output({"profiles", "--no-boot"});
  EXPECT_FALSE(contains(output({"profiles"}), "loaded at each start\n"));
  output({"profiles", "--delete", "soft"});
  EXPECT_EQ(output({"profiles", "--names"}), "");
  EXPECT_EQ(home.control({"profiles", "--boot", "a", "--no-boot"}).ending, exitedWith(2));
}

// --- parameters and events

TEST_F(HapticctlWork, GetAndParamsTakeNamesAndGroups) {
  const std::string safety = output({"get", "safety"});
  EXPECT_TRUE(safety.starts_with("safety.")) << safety;
  EXPECT_EQ(output({"get", "safety."}), safety);
  const std::string some = output({"get", "force.law", "safety", "force.law"});
  EXPECT_EQ(some, "force.law = nearest_springs\n" + safety);
  const std::string table = output({"params", "safety"});
  EXPECT_TRUE(table.starts_with("NAME")) << table;
  EXPECT_EQ(std::ranges::count(table, '\n'), std::ranges::count(safety, '\n') + 1);
  EXPECT_EQ(reply({"get", "force.radius_m"})["parameters"].size(), 1U);
  EXPECT_EQ(output({"get", "synthetic.seed"}), "synthetic.seed = 1\n")
      << "of a stand-in, which no list shows";
  EXPECT_TRUE(contains(refusal({"get", "safety", "force.radios_m"}), "did you mean force.radius_m"));
}

TEST_F(HapticctlWork, SetChangesAndShowsBeforeAndAfter) {
  EXPECT_EQ(output({"set", "force.stiffness_n_per_m=800", "force.min_points=7"}),
            "force.stiffness_n_per_m: 500 -> 800 N/m\nforce.min_points: 10 -> 7\n");
  EXPECT_EQ(output({"get", "force.stiffness_n_per_m", "force.min_points"}),
            "force.stiffness_n_per_m = 800 N/m\nforce.min_points = 7\n");
  EXPECT_EQ(reply({"set", "force.radius_m=3e-2"})["changes"],
            R"([{"name":"force.radius_m","before":0.04,"after":0.03,"unit":"m"}])"_json);
}

TEST_F(HapticctlWork, SetThatIsRefusedNamesAllProblemsAndRangesAndChangesNothing) {
  const std::string values = output({"get"});
  for (const std::string bad : {"-1", "5001", "stiff", "", "1e999", "5000.001", "0x10"}) {
    EXPECT_TRUE(
        contains(refusal({"set", "force.min_points=20", "force.stiffness_n_per_m=" + bad}), "0..5000 N/m"));
  }
  for (const std::string bad : {"nan", "inf", "-inf"})
    EXPECT_TRUE(contains(refusal({"set", "force.radius_m=" + bad}), "force.radius_m"));
  const std::string several = refusal({"set", "force.radios_m=0.03", "force.min_points=many"});
  EXPECT_TRUE(contains(several, "nothing was changed"));
  EXPECT_TRUE(
      contains(several, "force.radios_m: there is no parameter of this name (did you mean force.radius_m"));
  EXPECT_TRUE(contains(several, "force.min_points: "));
  const std::string restart = refusal({"set", "camera.near_m=0.5"});
  EXPECT_TRUE(
      contains(restart, "only at the next start\n  camera.near_m\nset them in hapticd's configuration"));
  const json as_json = json::parse(refusal({"--json", "set", "force.radius_m=7"}));
  EXPECT_EQ(as_json["error"], "io.hapticd.Control.InvalidValue");
  EXPECT_EQ(as_json["parameters"]["problems"][0]["parameter"], "force.radius_m");
  EXPECT_EQ(output({"get"}), values);
}

TEST_F(HapticctlWork, EventsShowsTheNewestOfThePast) {
  for (const char* value : {"301", "302", "303"})
    output({"set", std::string("force.stiffness_n_per_m=") + value});
  const std::string newest = output({"events", "-n", "2", "--kind", "parameter,camera"});
  EXPECT_EQ(std::ranges::count(newest, '\n'), 2) << newest;
  EXPECT_FALSE(contains(newest, "to 301"));
  EXPECT_TRUE(contains(newest, "to 303"));
  const Finished unknown = home.control({"events", "--kind", "mode,kamera"});
  EXPECT_EQ(unknown.ending, exitedWith(2));
  EXPECT_TRUE(contains(unknown.errors, "\"kamera\" is not one of: mode, camera,"));
}

// --- metrics

TEST_F(HapticctlWork, MetricsAnswersOneHttpRequest) {
  const Finished got =
      home.controlWithInput("GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n", {"metrics", "--http"});
  EXPECT_EQ(got.ending, exitedWith(0));
  EXPECT_TRUE(got.output.starts_with("HTTP/1.1 200 OK\r\n")) << got.output;
  EXPECT_TRUE(contains(got.output, "\nhapticd_loop_ticks_total "));
  EXPECT_TRUE(got.output.ends_with("# EOF\n"));
  EXPECT_TRUE(home.controlWithInput("", {"metrics", "--http"}).output.starts_with("HTTP/1.1 400 "));
}

// The checker of the Debian package prometheus.
TEST_F(HapticctlWork, PromtoolFindsNothingToComplainAboutInTheMetrics) {
  const std::string promtool = unpackedProgram("promtool");
  if (promtool.empty()) GTEST_SKIP() << "no promtool here (Debian package prometheus)";
  const std::string text = home.write("metrics", output({"metrics", "--prometheus"}));
  const Finished checked = runToEnd({"/bin/sh", "-c", promtool + " check metrics < '" + text + "'"});
  EXPECT_EQ(checked.ending, exitedWith(0));
  EXPECT_EQ(checked.output + checked.errors, "");
}

// --- snapshot

TEST_F(HapticctlWork, SnapshotWritesPointsAndPictureAndReplacesFilesOnlyWithForce) {
  const std::string ply = file("a.ply");
  EXPECT_TRUE(contains(output({"snapshot", "--ply", ply, "--png", file("a.png")}),
                       "307200 of 307200 pixels measured\n"));
  // 480 rows of 640 points, proxy and HIP, 15 bytes each, behind a header
  EXPECT_GT(fs::file_size(ply), 15U * (480U * 640U + 2U));
  EXPECT_GT(fs::file_size(file("a.png")), 100U);
  const std::string old = home.write("old.ply", "old");
  EXPECT_TRUE(contains(refusal({"snapshot", "--ply", old}), "exists already"));
  EXPECT_EQ(fs::file_size(old), 3U);
  output({"snapshot", "--ply", old, "--force"});
  EXPECT_GT(fs::file_size(old), 3U);
}

TEST_F(HapticctlWork, SnapshotLeavesNothingOnAFullDisk) {
  const Finished full = home.control({"snapshot", "--ply", file("a.ply")}, {.largest_file_bytes = 100'000});
  EXPECT_EQ(full.ending, exitedWith(1));
  EXPECT_TRUE(contains(full.errors, "cannot be written"));
  for (const std::string& name : home.entries()) EXPECT_EQ(name.find("a.ply"), std::string::npos) << name;
}

// --- registration

/// The world is the camera's frame turned by 90 degrees about z, and 1 m along x.
const std::string kTurned =
    "name,camera_x_m,camera_y_m,camera_z_m,world_x_m,world_y_m,world_z_m\n"
    "a,0,0,-1,1,0,-1\n"
    "b,0.3,0,-1,1,0.3,-1\n"
    "c,0,0.3,-1,0.7,0,-1\n";

TEST_F(HapticctlWork, RegisterSendsThePoseThatFitsThePairsAndGoesBackToTheConfiguration) {
  const std::string said = output({"register", "--points", home.write("pairs.csv", kTurned)});
  EXPECT_TRUE(contains(said, "yaw 90.00 degrees"));
  EXPECT_TRUE(contains(said, "it takes effect at the next start: systemctl restart hapticd"));
  const json waiting = reply({"register", "--show"})["calibration"]["waiting"];
  EXPECT_NEAR(waiting["xM"].get<double>(), 1, 1e-9);
  EXPECT_NEAR(waiting["yawRad"].get<double>(), M_PI / 2, 1e-9);
  output({"register", "--reset"});
  EXPECT_TRUE(contains(output({"register", "--show"}), "in use   at (0.0000, 0.0000, 0.0000) m"));
  EXPECT_TRUE(reply({"register", "--show"})["calibration"]["waiting"].is_null());
}

TEST_F(HapticctlWork, RegisterRefusesALargeResidualUnlessForced) {
  const std::string off = home.write("off.csv", kTurned + "d,0.3,0.3,-1,0.7,0.36,-1\n");
  const auto waits = [this] { return !reply({"register", "--show"})["calibration"]["waiting"].is_null(); };
  EXPECT_TRUE(contains(refusal({"register", "--points", off}), "nothing was changed: a point is off by "));
  output({"register", "--points", off, "--dry-run", "--force"});
  EXPECT_FALSE(waits());
  output({"register", "--points", off, "--force"});
  EXPECT_TRUE(waits());
  EXPECT_EQ(home.control({"register"}).ending, exitedWith(2));
  EXPECT_EQ(home.control({"register", "--points", "a", "--landmarks", "b"}).ending, exitedWith(2));
}

TEST_F(HapticctlWork, RegisterNamesLandmarksThatHaveNoDepth) {
  const std::string marks = home.write("marks.csv", "name,column_px,row_px\na,100,0\nb,500,100\nc,300,400\n");
  daemon.terminate();
  Daemon blind(home, std::string(kWallYaml) + "", {"synthetic.distance_m=5"});
  ASSERT_TRUE(blind.answers());
  ASSERT_TRUE(blind.reaches([](const json& status) { return status["camera"]["frames"] > 0; }));
  const std::string unseen = refusal({"register", "--landmarks", marks});
  for (const char* name : {"a: 0 of 15", "b: 0 of 25", "c: 0 of 25"}) EXPECT_TRUE(contains(unseen, name));
}

TEST_F(HapticctlWork, VersionShowsAllThree) {
  const json versions = reply({"version"});
  for (const char* of : {"hapticd", "hapticctl", "kernel"}) EXPECT_TRUE(versions[of].is_string()) << of;
  EXPECT_EQ(versions["hapticd"], versions["hapticctl"]);
  EXPECT_TRUE(output({"--version"}).starts_with("hapticctl "));
}

// --- without a daemon

TEST(HapticctlWithoutADaemon, AMistypedCommandIsNamedWithTheOneThatWasMeant) {
  const DaemonHome home;
  const Finished mistyped = home.control({"statsu"});
  EXPECT_EQ(mistyped.ending, exitedWith(2));
  EXPECT_EQ(mistyped.errors,
            "hapticctl: there is no command 'hapticctl statsu' (did you mean status?)\n"
            "Run 'hapticctl --help' for more information.\n");
  const Finished below = home.control({"trace", "exprot", "a.mcap"});
  EXPECT_EQ(below.ending, exitedWith(2));
  EXPECT_EQ(below.errors,
            "hapticctl: there is no command 'hapticctl trace exprot' (did you mean export?)\n"
            "Run 'hapticctl trace --help' for more information.\n");
  EXPECT_EQ(home.control({"help", "trace", "exprot"}).errors, below.errors);
  EXPECT_EQ(home.control({"help", "trace", "list"}).output,
            runToEnd(hapticctlCommand({"trace", "list", "--help"})).output);
  EXPECT_TRUE(contains(home.control({"trace"}).errors, "required"));
  EXPECT_EQ(home.control({"profiles", "--names", "--boot", "a"}).ending, exitedWith(2));
  EXPECT_TRUE(contains(home.control({"trace", "info"}).errors, "TRACE is required"));
}

TEST(HapticctlWithoutADaemon, WrongUsageIsExplainedWithExitStatus2) {
  const DaemonHome home;
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{},
                                                    {"set"},
                                                    {"set", "force.radius_m"},
                                                    {"set", "=1"},
                                                    {"set", "a=1", "a=2"},
                                                    {"status", "--nope"},
                                                    {"watch", "--interval", "5"},
                                                    {"watch", "--count", "x"}}) {
    const Finished refused = home.control(arguments);
    EXPECT_EQ(refused.ending, exitedWith(2)) << refused.output;
    EXPECT_TRUE(contains(refused.errors, "--help"));
  }
}

TEST(HapticctlWithoutADaemon, MetricsSaysOverHttpThatTheDaemonIsDown) {
  const DaemonHome home;
  const Finished got = home.controlWithInput("GET /metrics HTTP/1.1\r\n\r\n", {"metrics", "--http"});
  EXPECT_EQ(got.ending, exitedWith(0));
  EXPECT_TRUE(contains(got.output, "\nhapticd_up 0\n# EOF\n"));
}

}  // namespace
}  // namespace hapticd::test
