// SPDX-License-Identifier: Apache-2.0
// The calls, output and files of hapticctl's commands, against a fake daemon.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <filesystem>

#include "tests/system/fake_daemon.h"
#include "tests/system/fake_replies.h"
#include "tests/system/hapticctl_home.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kPairsHeader = "name,camera_x_m,camera_y_m,camera_z_m,world_x_m,world_y_m,world_z_m\n";

class HapticctlWork : public testing::Test {
 protected:
  HapticctlWork() : daemon(home.socket()) { answerEverything(daemon); }

  std::string file(const std::string& name) const { return (home.path() / name).string(); }
  std::string write(const std::string& name, const std::string& content) const {
    return home.folder().write(name, content).string();
  }
  json newest(const std::string& method) const { return daemon.newestCall("io.hapticd." + method); }
  bool wasCalled(const std::string& method) const { return !newest(method).is_null(); }

  HapticctlHome home;
  FakeDaemon daemon;
};

// --- traces and profiles

TEST_F(HapticctlWork, TraceCommandsSendWhatTheyAreTold) {
  EXPECT_EQ(home.run({"trace", "start", "--label", "demo", "--depth"}).output,
            "writing 2026-03-04T05-06-07Z\n");
  EXPECT_EQ(newest("Control.StartTrace"), (json{{"label", "demo"}, {"depth", true}}));
  home.run({"trace", "start"});
  EXPECT_EQ(newest("Control.StartTrace"), json::object());
  EXPECT_EQ(home.run({"trace", "dump"}).output, "wrote 2026-03-04T05-06-07Z\n");
  EXPECT_EQ(home.run({"trace", "delete", "old"}).output, "deleted old\n");
  EXPECT_EQ(newest("Control.DeleteTrace"), (json{{"name", "old"}}));
}

TEST_F(HapticctlWork, TraceListShowsNamesSizesAndWhatIsOpen) {
  daemon.answer(
      "io.hapticd.Status.ListTraces",
      json{{"folder", "/x"},
           {"traces",
            {{{"name", "a"}, {"bytes", 12'300'000}, {"timeNs", 0}, {"open", false}, {"depth", true}},
             {{"name", "b\033"}, {"bytes", 1}, {"timeNs", 0}, {"open", true}, {"depth", false}}}}});
  const std::string output = home.run({"trace", "list"}).output;
  EXPECT_TRUE(output.starts_with("NAME")) << output;
  EXPECT_TRUE(has(output, "12.3 MB  finished, with depth\n")) << output;
  EXPECT_TRUE(has(output, "b\\x1b")) << output;
  EXPECT_TRUE(has(output, "1 B  being written\n")) << output;
  EXPECT_TRUE(has(output, "\n2 traces, 12.3 MB\n")) << output;
  EXPECT_EQ(home.run({"trace", "list", "--names", "--sort", "name", "--reverse"}).output, "b\\x1b\na\n");
  EXPECT_TRUE(
      has(home.run({"trace", "list", "--state", "writing"}).output, "\n1 trace, 1 B of 2 traces, 12.3 MB"));
  const Finished bad = home.run({"trace", "list", "--since", "yesterday"});
  EXPECT_EQ(bad.ending, exitedWith(2));
  EXPECT_TRUE(has(bad.errors, "hapticctl: --since: \"yesterday\" is no time in UTC")) << bad.errors;
  EXPECT_TRUE(has(bad.errors, "Run 'hapticctl trace list --help' for more information.")) << bad.errors;
}

TEST_F(HapticctlWork, SeveralTracesAreDeletedOnlyWhenConfirmed) {
  const auto trace = [](const char* name, std::int64_t begin_ns, bool open, bool kept) {
    return json{{"name", name},   {"bytes", 1'000'000}, {"timeNs", begin_ns}, {"open", open},
                {"depth", false}, {"kept", kept},       {"note", ""},         {"beginNs", begin_ns}};
  };
  constexpr std::int64_t kOld = 1'700'000'000'000'000'000;  // November 2023
  daemon.answer("io.hapticd.Status.ListTraces",
                json{{"folder", "/x"},
                     {"traces",
                      {trace("old", kOld, false, false), trace("older", kOld - 1, false, false),
                       trace("mine", kOld, false, true), trace("now", kOld, true, false)}}});
  const Finished refused = home.runWithInput("n\n", {"trace", "delete", "--older-than", "30d"});
  EXPECT_EQ(refused.ending, exitedWith(1));
  for (const char* said :
       {"mine stays", "now stays", "2 traces, 2.0 MB", "delete them? [y/N]", "nothing was deleted"}) {
    EXPECT_TRUE(has(refused.errors, said)) << refused.errors << " lacks " << said;
  }
  EXPECT_FALSE(wasCalled("Control.DeleteTrace"));
  EXPECT_EQ(home.runWithInput("", {"trace", "delete", "old", "older"}).ending, exitedWith(1));
  EXPECT_FALSE(wasCalled("Control.DeleteTrace"));

  const Finished kept = home.run({"trace", "delete", "--yes", "old", "mine", "now", "none"});
  EXPECT_EQ(kept.ending, exitedWith(1));
  for (const char* said : {"mine is kept (hapticctl trace keep --undo mine)", "now is being written",
                           "none: there is no such trace"}) {
    EXPECT_TRUE(has(kept.errors, said)) << kept.errors << " lacks " << said;
  }
  EXPECT_FALSE(wasCalled("Control.DeleteTrace"));

  const Finished done = home.run({"trace", "delete", "--older-than", "30d", "--yes"});
  EXPECT_EQ(done.ending, exitedWith(0)) << done.errors;
  EXPECT_EQ(done.output, "deleted old\ndeleted older\ndeleted 2 traces, 2.0 MB\n");
  EXPECT_EQ(newest("Control.DeleteTrace"), (json{{"name", "older"}}));
  EXPECT_EQ(home.runWithInput("y\n", {"trace", "delete", "old", "older"}).ending, exitedWith(0));
  EXPECT_EQ(home.run({"trace", "delete"}).ending, exitedWith(2));
  EXPECT_EQ(home.run({"trace", "delete", "old", "--older-than", "1d"}).ending, exitedWith(2));
}

TEST_F(HapticctlWork, NotesAndMarksAreSentAsTheyAre) {
  EXPECT_EQ(home.run({"trace", "note", "old", "participant 7"}).output, "noted for old: participant 7\n");
  EXPECT_EQ(newest("Control.NoteTrace"), (json{{"name", "old"}, {"text", "participant 7"}}));
  EXPECT_EQ(home.run({"trace", "note", "old", ""}).output, "removed the note of old\n");
  EXPECT_EQ(home.run({"trace", "mark", "trial 3"}).output, "marked 2026-03-04T05-06-07Z: trial 3\n");
  EXPECT_EQ(newest("Control.MarkTrace"), (json{{"text", "trial 3"}}));
}

// --- parameters

TEST_F(HapticctlWork, GetAndParamsTakeNamesAndGroups) {
  json rows = json::array();
  for (const char* name : {"camera.near_m", "force.radius_m", "force.law", "forces.x"}) {
    rows.push_back({{"name", name}, {"value", 1}, {"unit", ""}, {"effect", "live"}, {"help", "one thing"}});
  }
  daemon.answer("io.hapticd.Status.GetParameters", json{{"parameters", rows}});
  const std::string force = "force.radius_m = 1\nforce.law = 1\n";
  EXPECT_EQ(home.run({"get", "force"}).output, force);
  EXPECT_EQ(home.run({"get", "force."}).output, force);
  EXPECT_EQ(home.run({"get", "force.law", "camera", "force"}).output,
            "force.law = 1\ncamera.near_m = 1\nforce.radius_m = 1\n");
  const std::string table = home.run({"params", "camera"}).output;
  EXPECT_TRUE(table.starts_with("NAME")) << table;
  EXPECT_EQ(std::ranges::count(table, '\n'), 2) << table;
  EXPECT_EQ(json::parse(home.run({"--json", "get", "camera"}).output)["parameters"].size(), 1U);
  home.run({"get", "force", "forc"});
  EXPECT_EQ(newest("Status.GetParameters"), (json{{"names", {"forc"}}})) << "the daemon knows what is near";
}

TEST_F(HapticctlWork, TraceFilesAreLookedForByNameInTheFolderOfTheDaemon) {
  daemon.answer("io.hapticd.Status.ListTraces",
                json{{"folder", home.path().string()}, {"traces", json::array()}});
  EXPECT_TRUE(has(home.run({"trace", "info", "nothing"}).errors, file("nothing.mcap")));
  write("cut.mcap.part", "");
  EXPECT_TRUE(has(home.run({"trace", "info", "cut"}).errors, file("cut.mcap.part")));
  const Finished path = home.run({"trace", "info", "/no/such.mcap"});
  EXPECT_EQ(path.ending, exitedWith(1));
  EXPECT_TRUE(has(path.errors, "/no/such.mcap")) << path.errors;
}

TEST_F(HapticctlWork, ProfilesAreSavedLoadedDeletedAndChosen) {
  EXPECT_EQ(home.run({"save", "soft"}).output, "saved soft\n");
  EXPECT_EQ(home.run({"load", "soft"}).output, "loaded; changed:\n  force.radius_m\n");
  EXPECT_TRUE(has(home.run({"profiles"}).output, "loaded at each start\n"));
  home.run({"profiles", "--boot", "soft"});
  EXPECT_EQ(newest("Control.SetBootProfile"), (json{{"name", "soft"}}));
  home.run({"profiles", "--no-boot"});
  EXPECT_EQ(newest("Control.SetBootProfile"), (json{{"name", nullptr}}));
  EXPECT_EQ(home.run({"profiles", "--boot", "a", "--no-boot"}).ending, exitedWith(2));
}

// --- events

TEST_F(HapticctlWork, EventsShowsTheNewestOfThePast) {
  FakeAnswer answer{.endless = true};
  for (int i = 1; i <= 5; ++i) {
    answer.replies.push_back({{"event",
                               {{"number", i},
                                {"timeNs", 0},
                                {"kind", "mode"},
                                {"priority", "info"},
                                {"text", "number " + std::to_string(i)}}},
                              {"droppedCount", 0}});
  }
  daemon.answer("io.hapticd.Status.Events", answer);
  const std::string output = home.run({"events", "-n", "2", "--kind", "mode,camera"}).output;
  EXPECT_FALSE(has(output, "number 3")) << output;
  EXPECT_TRUE(has(output, "info     mode        number 4\n")) << output;
  EXPECT_TRUE(has(output, "number 5\n")) << output;
  EXPECT_EQ(newest("Status.Events"), (json{{"kinds", {"mode", "camera"}}}));
  const Finished unknown = home.run({"events", "--kind", "mode,kamera"});
  EXPECT_EQ(unknown.ending, exitedWith(2));
  EXPECT_TRUE(has(unknown.errors, "kamera not in {mode,camera,")) << unknown.errors;
}

TEST_F(HapticctlWork, EventsFollowsUntilTheDaemonEndsAndSaysWhatWasLost) {
  const json first{{"event", {{"text", "first"}}}, {"droppedCount", 0}};
  const json second{{"event", {{"text", "second"}}}, {"droppedCount", 7}};
  daemon.answer("io.hapticd.Status.Events", FakeAnswer{.replies = {first, second}, .endless = true});
  Program events(home.command({"events", "--follow"}));
  ASSERT_TRUE(becomesTrue([&] { return has(events.output(), "second"); }));
  EXPECT_TRUE(has(events.errors(), "7 events were lost here"));
  events.signal(SIGTERM);
  EXPECT_EQ(events.wait(), exitedWith(0));
}

// --- the command line

TEST(HapticctlWithoutADaemon, AMistypedCommandIsNamedWithTheOneThatWasMeant) {
  const HapticctlHome home;
  const Finished mistyped = home.run({"statsu"});
  EXPECT_EQ(mistyped.ending, exitedWith(2));
  EXPECT_EQ(mistyped.errors,
            "hapticctl: there is no command 'hapticctl statsu' (did you mean status?)\n"
            "Run 'hapticctl --help' for more information.\n");
  const Finished below = home.run({"trace", "exprot", "a.mcap"});
  EXPECT_EQ(below.ending, exitedWith(2));
  EXPECT_EQ(below.errors,
            "hapticctl: there is no command 'hapticctl trace exprot' (did you mean export?)\n"
            "Run 'hapticctl trace --help' for more information.\n");
  EXPECT_EQ(home.run({"help", "trace", "exprot"}).errors, below.errors);
  EXPECT_EQ(home.run({"help", "trace", "list"}).output,
            runToEnd({HAPTICCTL_PROGRAM, "trace", "list", "--help"}).output);
  EXPECT_TRUE(has(home.run({"trace"}).errors, "required"));
  EXPECT_EQ(home.run({"profiles", "--names", "--boot", "a"}).ending, exitedWith(2));
  EXPECT_TRUE(has(home.run({"trace", "info"}).errors, "TRACE is required"));
}

// --- metrics

TEST_F(HapticctlWork, MetricsAnswersOneHttpRequest) {
  const Finished got =
      home.runWithInput("GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n", {"metrics", "--http"});
  EXPECT_EQ(got.ending, exitedWith(0));
  EXPECT_TRUE(got.output.starts_with("HTTP/1.1 200 OK\r\n")) << got.output;
  EXPECT_TRUE(has(got.output, "\nhapticd_loop_ticks_total 61500\n"));
  EXPECT_TRUE(got.output.ends_with("# EOF\n"));
  EXPECT_TRUE(home.runWithInput("", {"metrics", "--http"}).output.starts_with("HTTP/1.1 400 "));
  const Finished older = home.runWithInput(
      "GET /metrics HTTP/1.1\r\nAccept: text/plain;version=0.0.4\r\n\r\n", {"metrics", "--http"});
  EXPECT_TRUE(has(older.output, "Content-Type: text/plain; version=0.0.4")) << older.output;
  EXPECT_TRUE(has(older.output, "# TYPE hapticd_loop_ticks_total counter\n")) << older.output;
}

// The checker of the Debian package prometheus.
TEST_F(HapticctlWork, PromtoolFindsNothingToComplainAboutInTheMetrics) {
  const std::string promtool = unpackedProgram("promtool");
  if (promtool.empty()) GTEST_SKIP() << "no promtool here (Debian package prometheus)";
  const Finished metrics = home.run({"metrics", "--prometheus"});
  ASSERT_EQ(metrics.ending, exitedWith(0)) << metrics.errors;
  const std::string text = write("metrics", metrics.output);
  const Finished checked = runToEnd({"/bin/sh", "-c", promtool + " check metrics < '" + text + "'"});
  EXPECT_EQ(checked.ending, exitedWith(0));
  EXPECT_EQ(checked.output + checked.errors, "");
}

TEST(HapticctlWithoutADaemon, MetricsSaysOverHttpThatTheDaemonIsDown) {
  const HapticctlHome home;
  const Finished got = home.runWithInput("GET /metrics HTTP/1.1\r\n\r\n", {"metrics", "--http"});
  EXPECT_EQ(got.ending, exitedWith(0));
  EXPECT_TRUE(has(got.output, "\nhapticd_up 0\n# EOF\n")) << got.output;
}

// --- snapshot

TEST_F(HapticctlWork, SnapshotWritesPointsAndPicture) {
  const Finished finished = home.run({"snapshot", "--ply", file("a.ply"), "--png", file("a.png")});
  ASSERT_EQ(finished.ending, exitedWith(0)) << finished.errors;
  EXPECT_TRUE(has(finished.output, "frame 7: 306560 of 307200 pixels measured\n")) << finished.output;
  // 479 rows of 640 points, proxy and HIP, 15 bytes each, behind a header
  EXPECT_GT(fs::file_size(file("a.ply")), 15U * (479U * 640U + 2U));
  EXPECT_GT(fs::file_size(file("a.png")), 100U);
}

TEST_F(HapticctlWork, SnapshotReplacesFilesOnlyWithForceAndAsksNothingBefore) {
  const std::string old = write("old.ply", "old");
  const Finished refused = home.run({"snapshot", "--ply", old});
  EXPECT_EQ(refused.ending, exitedWith(1));
  EXPECT_TRUE(has(refused.errors, "exists already"));
  EXPECT_EQ(fs::file_size(old), 3U);
  EXPECT_FALSE(wasCalled("Status.GetSnapshot"));
  EXPECT_EQ(home.run({"snapshot", "--ply", old, "--force"}).ending, exitedWith(0));
  EXPECT_GT(fs::file_size(old), 3U);
}

TEST_F(HapticctlWork, SnapshotLeavesNothingOnAFullDisk) {
  const Finished full = home.run({"snapshot", "--ply", file("a.ply")}, {.largest_file_bytes = 100'000});
  EXPECT_EQ(full.ending, exitedWith(1));
  EXPECT_TRUE(has(full.errors, "cannot be written")) << full.errors;
  for (const auto& entry : fs::directory_iterator(home.path())) {
    EXPECT_EQ(entry.path().string().find("a.ply"), std::string::npos) << entry.path();
  }
}

TEST_F(HapticctlWork, SnapshotRefusesAFrameThatIsCutOff) {
  FakeAnswer answer = snapshotOfAWall(760, 120);
  answer.replies.pop_back();
  daemon.answer("io.hapticd.Status.GetSnapshot", answer);
  const Finished cut = home.run({"snapshot", "--ply", file("a.ply")});
  EXPECT_EQ(cut.ending, exitedWith(1));
  EXPECT_TRUE(has(cut.errors, "360 rows where a frame has 480")) << cut.errors;
  EXPECT_FALSE(fs::exists(file("a.ply")));
}

// --- registration

/// The world is the camera's frame turned by 90 degrees about z, and 1 m along x.
const std::string kTurned = std::string(kPairsHeader) +
                            "a,0,0,-1,1,0,-1\n"
                            "b,0.3,0,-1,1,0.3,-1\n"
                            "c,0,0.3,-1,0.7,0,-1\n";

TEST_F(HapticctlWork, RegisterSendsThePoseThatFitsThePairs) {
  const Finished finished = home.run({"register", "--points", write("pairs.csv", kTurned)});
  ASSERT_EQ(finished.ending, exitedWith(0)) << finished.errors;
  EXPECT_TRUE(has(finished.output, "yaw 90.00 degrees")) << finished.output;
  EXPECT_TRUE(has(finished.output, "it takes effect at the next start: systemctl restart hapticd"));
  const json sent = newest("Control.SetCalibration");
  EXPECT_NEAR(sent["cameraPose"]["xM"].get<double>(), 1, 1e-9);
  EXPECT_NEAR(sent["cameraPose"]["yawRad"].get<double>(), M_PI / 2, 1e-9);
  EXPECT_LT(sent["residualM"].get<double>(), 1e-9);
}

TEST_F(HapticctlWork, RegisterRefusesALargeResidualUnlessForced) {
  const std::string off = write("off.csv", kTurned + "d,0.3,0.3,-1,0.7,0.36,-1\n");
  const Finished refused = home.run({"register", "--points", off});
  EXPECT_EQ(refused.ending, exitedWith(1));
  EXPECT_TRUE(has(refused.errors, "nothing was changed: a point is off by ")) << refused.errors;
  EXPECT_FALSE(wasCalled("Control.SetCalibration"));
  EXPECT_EQ(home.run({"register", "--points", off, "--dry-run", "--force"}).ending, exitedWith(0));
  EXPECT_FALSE(wasCalled("Control.SetCalibration"));
  EXPECT_EQ(home.run({"register", "--points", off, "--force"}).ending, exitedWith(0));
  EXPECT_TRUE(wasCalled("Control.SetCalibration"));
}

TEST_F(HapticctlWork, RegisterTakesOneSourceOfPoints) {
  EXPECT_EQ(home.run({"register"}).ending, exitedWith(2));
  EXPECT_EQ(home.run({"register", "--points", "a", "--landmarks", "b"}).ending, exitedWith(2));
}

TEST_F(HapticctlWork, RegisterByTouchJoinsPixelsToWhereTheHandleIs) {
  const std::string marks =
      write("marks.csv", "name,column_px,row_px\na,100,100\nb,500,100\nc,300,400\nd,10,10\n");
  // the handle rests at one place, so the world's points are one
  const Finished one = home.runWithInput("\n\n\ns\n", {"register", "--landmarks", marks});
  EXPECT_EQ(one.ending, exitedWith(1));
  EXPECT_TRUE(has(one.errors, "touch 'c' with the handle, press Enter and hold still for a second"))
      << one.errors;
  EXPECT_TRUE(has(one.errors, "the world's points lie on a line: 0.0 mm across it")) << one.errors;
  EXPECT_FALSE(wasCalled("Control.SetCalibration"));
}

// The camera stands 1 m along x of the world's origin; the hand rests twenty readings long on each landmark
// with a tenth of a millimetre of noise, and glides by 8 mm in the first second on the second one.
TEST_F(HapticctlWork, RegisterByTouchFindsTheCamera) {
  const std::string marks = write("marks.csv", "name,column_px,row_px\na,100,100\nb,500,100\nc,300,400\n");
  const double depth_m = 1 / (-0.003071102 * 760 + 3.330949516);
  FakeAnswer readings{.in_turn = true};
  const auto touch = [&](double column, double row, double noise_m, double glide_m) {
    for (int i = 0; i < 20; ++i) {
      const double off_m = (i % 2 == 0 ? noise_m : -noise_m) + glide_m * (i / 19.0 - 0.5);
      const json hip{{"x", 1 + depth_m * (column - 339.307810) / 594.214342 + off_m},
                     {"y", -depth_m * (row - 242.739138) / 591.040537},
                     {"z", -depth_m}};
      readings.replies.push_back({{"status", statusWith({{"tick", {{"hipMInWorld", hip}}}})}});
    }
  };
  touch(100, 100, 1e-4, 0);
  touch(500, 100, 0, 0.008);
  touch(500, 100, 1e-4, 0);
  touch(300, 400, 1e-4, 0);
  daemon.answer("io.hapticd.Status.GetStatus", readings);
  const auto begin = std::chrono::steady_clock::now();
  const Finished finished = home.runWithInput("\n\n\n\n", {"register", "--landmarks", marks});
  EXPECT_GE(std::chrono::steady_clock::now() - begin, 4 * std::chrono::milliseconds(950))
      << "readings at once would not show that a hand moves";
  ASSERT_EQ(finished.ending, exitedWith(0)) << finished.errors;
  EXPECT_TRUE(has(finished.errors, "the handle moved by 4.0 mm within a second, at most 2 mm are allowed"))
      << finished.errors;
  const json pose = newest("Control.SetCalibration")["cameraPose"];
  EXPECT_NEAR(pose["xM"].get<double>(), 1, 1e-3);
  EXPECT_NEAR(pose["yM"].get<double>(), 0, 1e-3);
  EXPECT_NEAR(pose["zM"].get<double>(), 0, 1e-3);
}

TEST_F(HapticctlWork, RegisterByTouchChangesNothingWhenGivenUpOrWithoutHandle) {
  const std::string marks = write("marks.csv", "name,column_px,row_px\na,100,100\nb,500,100\nc,300,400\n");
  EXPECT_TRUE(has(home.runWithInput("\nq\n", {"register", "--landmarks", marks}).errors, "given up"));
  EXPECT_TRUE(has(home.runWithInput("", {"register", "--landmarks", marks}).errors, "given up"));
  daemon.answer("io.hapticd.Status.GetStatus",
                json{{"status", statusWith({{"handle", {{"state", "lost"}}}})}});
  const Finished lost = home.runWithInput("\n", {"register", "--landmarks", marks});
  EXPECT_EQ(lost.ending, exitedWith(1));
  EXPECT_TRUE(has(lost.errors, "the handle is lost: nothing can be touched with it")) << lost.errors;
  EXPECT_FALSE(wasCalled("Control.SetCalibration"));
}

TEST_F(HapticctlWork, RegisterNamesLandmarksThatHaveNoDepth) {
  const std::string marks = write("marks.csv", "name,column_px,row_px\na,100,0\nb,500,100\nc,300,400\n");
  daemon.answer("io.hapticd.Status.GetSnapshot", snapshotOfAWall(2047, 480));
  const Finished unseen = home.runWithInput("", {"register", "--landmarks", marks});
  EXPECT_EQ(unseen.ending, exitedWith(1));
  for (const char* name : {"a: 0 of 15", "b: 0 of 25", "c: 0 of 25"}) {
    EXPECT_TRUE(has(unseen.errors, name)) << unseen.errors;
  }
}

TEST_F(HapticctlWork, RegisterGoesBackToTheConfiguration) {
  EXPECT_EQ(home.run({"register", "--reset"}).ending, exitedWith(0));
  EXPECT_EQ(newest("Control.SetCalibration"), json::object());
  EXPECT_TRUE(has(home.run({"register", "--show"}).output, "in use   at (0.0000, 0.0000, 0.0000) m"));
}

// --- versions

TEST_F(HapticctlWork, VersionShowsAllThree) {
  const json versions = json::parse(home.run({"--json", "version"}).output);
  EXPECT_EQ(versions["hapticd"], "0.1.0");
  EXPECT_EQ(versions["kernel"], "6.1.0-50-rt-amd64");
  EXPECT_TRUE(versions["hapticctl"].is_string());
}

}  // namespace
}  // namespace hapticd::test
