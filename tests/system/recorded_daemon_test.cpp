// SPDX-License-Identifier: Apache-2.0
// hapticd with the camera driver `recorded`.

#include <gtest/gtest.h>

#include "drivers/camera/recorded/recording_writer.h"
#include "tests/support/recordings/made_up_scene.h"
#include "tests/support/recordings/scratch_recording.h"
#include "tests/system/support/daemon_under_test.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd {
namespace {

using test::contains;
using test::Daemon;
using test::DaemonHome;
using test::exitedWith;
using test::Finished;
using test::ScratchRecording;

constexpr int kConfiguration = 78;

std::vector<std::string> playing(const std::filesystem::path& recording, const std::string& loop = "true") {
  return {"camera.driver=recorded", "camera.recording=" + recording.string(), "camera.loop=" + loop};
}

std::string wallBytes() {
  return test::pgmBytes(test::wallImage(760));  // 1.003 m
}

/// `frames` images of a wall, 33 ms apart.
void fillWithWall(ScratchRecording& recording, int frames) {
  std::filesystem::path image;
  for (int frame = 0; frame < frames; ++frame) {
    const std::string time = "1500000000." + std::to_string(100 + 33 * frame);
    const auto ticks = static_cast<std::uint32_t>(1000 + frame);
    image = frame == 0 ? recording.addBytes(wallBytes(), time, ticks) : recording.addLink(image, time, ticks);
  }
}

/// Runs hapticd to its end, which must refuse the recording and leave no socket.
std::string refusalOf(const std::filesystem::path& recording) {
  const DaemonHome home;
  const Finished finished = test::runToEnd(home.command(test::kWallYaml, playing(recording)));
  EXPECT_EQ(finished.ending, exitedWith(kConfiguration)) << finished.errors;
  EXPECT_EQ(home.entries(), std::vector<std::string>{"hapticd.yaml"});
  return finished.errors;
}

TEST(RecordedDaemon, RefusesAFolderThatIsMissingOrNoRecording) {
  const test::TemporaryFolder empty;
  EXPECT_TRUE(contains(refusalOf(empty.path() / "none"), (empty.path() / "none").string()));
  EXPECT_TRUE(contains(refusalOf(empty.path()), "INDEX.txt"));
}

TEST(RecordedDaemon, RefusesAnIndexWithCrLfAndNamesTheRemedy) {
  ScratchRecording recording;
  fillWithWall(recording, 2);
  recording.writeIndex("\r\n");
  const std::string errors = refusalOf(recording.path());
  EXPECT_TRUE(contains(errors, "INDEX.txt:1: the line ends in CRLF"));
  EXPECT_TRUE(contains(errors, "sed -i"));
}

TEST(RecordedDaemon, PlaysARecordingWhoseFirstImageIsTruncatedAndNamesIt) {
  ScratchRecording recording;
  recording.addBytes(wallBytes().substr(0, 5000), "1500000000.01", 1);
  fillWithWall(recording, 3);
  recording.writeIndex();
  const DaemonHome home;
  Daemon daemon(home, test::kWallYaml, playing(recording.path()));
  ASSERT_TRUE(daemon.answers());
  EXPECT_TRUE(daemon.reaches([](const nlohmann::json& status) {
    const nlohmann::json& camera = status.at("camera");
    return camera.at("damagedFrames") >= 1 && camera.at("frames") >= 3 && camera.at("state") == "streaming" &&
           camera.at("detail").get<std::string>().find("d-1500000000.01-1.pgm: has 5000 bytes") !=
               std::string::npos;
  }));
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

/// A data set with 16-bit images of a camera, whose bytes are in the order of this computer and not of PGM.
void writeStereoRecording(const std::filesystem::path& folder, bool swap) {
  const auto camera = tools::stereoCamera(424, 240, 69, 0.05, 0.001, 0.4, 4);
  const auto writer = drivers::CameraRecordingWriter::create(
      folder, {.camera = camera, .near_m = {}, .far_m = {}, .serial = ""}, 1'700'000'000'000'000'000);
  ASSERT_TRUE(writer) << writer.error().text();
  for (int number = 0; number < 15; ++number) {
    const auto frame = tools::frameOf(camera, tools::tiltedPlane(camera, 1, 0.3));
    frame->arrival_ns = number * 33'000'000;
    frame->sequence = static_cast<std::uint64_t>(number) + 1;
    for (std::uint16_t& raw : frame->image()) {
      if (swap) raw = static_cast<std::uint16_t>(raw << 8 | raw >> 8);
    }
    ASSERT_TRUE((*writer)->write(*frame));
  }
}

TEST(RecordedDaemon, WarnsOfDepthThatCannotGiveAForce) {
  for (const bool swap : {true, false}) {
    const DaemonHome home;
    const std::filesystem::path recording = home.path() / "recording";
    writeStereoRecording(recording, swap);
    std::vector<std::string> set = playing(recording);
    // 1 m away, where the scene is not expected
    if (!swap) set.insert(set.end(), {"camera.near_m=2", "camera.far_m=3"});
    Daemon daemon(home, test::kWallYaml, set);
    ASSERT_TRUE(daemon.answers());
    EXPECT_TRUE(daemon.reaches([swap](const nlohmann::json& status) {
      return status.at("warnings")
                 .dump()
                 .find(swap ? "seem to be swapped" : "lies between camera.near_m and") != std::string::npos;
    }));
    if (swap) {
      const Finished doctor = home.control({"doctor"});
      EXPECT_TRUE(contains(doctor.output, "seem to be swapped"));
    }
    EXPECT_EQ(daemon.terminate(), exitedWith(0));
  }
}

TEST(RecordedDaemon, PlaysAtATenthOfTheSpeed) {
  ScratchRecording recording;
  fillWithWall(recording, 10);
  recording.writeIndex();
  const DaemonHome home;
  std::vector<std::string> set = playing(recording.path());
  set.insert(set.end(), {"camera.speed=0.1", "control.engage_at_start=true"});
  Daemon daemon(home, test::kWallYaml, set);
  ASSERT_TRUE(daemon.answers());
  EXPECT_TRUE(daemon.reaches([](const nlohmann::json& status) {
    const double rate_hz = status.at("scene").at("frameRateHz");
    return status.at("camera").at("frames") >= 6 && rate_hz > 2 && rate_hz < 4 &&
           status.at("mode") == "engaged" &&
           test::lengthOf(status.at("tick").at("commandForceNInWorld")) > 0.1;
  }));
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

TEST(RecordedDaemon, CountsALaterTruncatedImageAndPlaysOn) {
  ScratchRecording recording;
  fillWithWall(recording, 4);
  recording.addBytes(wallBytes().substr(0, 5000), "1500000000.300", 1);
  recording.writeIndex();
  const DaemonHome home;
  Daemon daemon(home, test::kWallYaml, playing(recording.path()));
  ASSERT_TRUE(daemon.answers());
  EXPECT_TRUE(daemon.reaches([](const nlohmann::json& status) {
    const nlohmann::json& camera = status.at("camera");
    return camera.at("damagedFrames") >= 2 && camera.at("frames") >= 9 && camera.at("state") == "streaming";
  }));
  EXPECT_TRUE(daemon.ticks());
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

TEST(RecordedDaemon, PlaysALoopOverAndOver) {
  ScratchRecording recording;
  fillWithWall(recording, 3);
  recording.writeIndex();
  const DaemonHome home;
  Daemon daemon(home, test::kWallYaml, playing(recording.path()));
  ASSERT_TRUE(daemon.answers());
  EXPECT_TRUE(daemon.reaches([](const nlohmann::json& status) {
    return status.at("camera").at("frames") >= 10 && status.at("camera").at("state") == "streaming" &&
           status.at("tick").at("sceneFrame") >= 10 && status.at("tick").at("pointsUsed") == 100;
  }));
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

TEST(RecordedDaemon, ShowsTheEndOfARecordingAsALostCameraAndLivesOnWithoutForce) {
  ScratchRecording recording;
  fillWithWall(recording, 3);
  recording.writeIndex();
  const DaemonHome home;
  std::vector<std::string> set = playing(recording.path(), "false");
  set.insert(set.end(), {"control.engage_at_start=true", "safety.depth_timeout_s=0.3"});
  Daemon daemon(home, test::kWallYaml, set);
  ASSERT_TRUE(daemon.answers());
  EXPECT_TRUE(daemon.reaches([](const nlohmann::json& status) {
    return status.at("camera").at("state") == "lost" && status.at("mode") == "holding" &&
           status.at("cause") == "depth_stale" &&
           test::lengthOf(status.at("tick").at("commandForceNInWorld")) == 0;
  }));
  const nlohmann::json status = daemon.status();
  EXPECT_EQ(status.at("camera").at("frames"), 3);
  EXPECT_TRUE(contains(status.at("warnings").dump(), "camera lost: the recording has ended"));
  EXPECT_TRUE(daemon.ticks());
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
}

}  // namespace
}  // namespace hapticd
