// SPDX-License-Identifier: Apache-2.0
// hapticd with recordings, with the camera driver recorded, and with each camera that the synthetic one
// plays.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "config/settings/settings.h"
#include "drivers/camera/recorded/recording_reader.h"
#include "drivers/camera/recorded/recording_writer.h"
#include "drivers/camera/synthetic/analytic_scene.h"
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

namespace hapticd::test {
namespace {

// The daemon with each camera that the synthetic camera plays: what the hand feels, and what a recording of
// it at rest shows of the camera's noise.

namespace fs = std::filesystem;
using drivers::PlayedCamera;
using nlohmann::json;

/// A hand that leans on a wall 1 m away.
constexpr const char* kYaml =
    "safety: {handle_timeout_s: 1, depth_timeout_s: 5, engage_inside: true, overrun_burst: 65}\n"
    "camera: {driver: synthetic}\n"
    "synthetic: {scene: plane, noise: sensor, distance_m: 1}\n"
    "simulated_handle: {script: lean, start_z_m: -0.97, travel_m: 0.06, press_force_n: 2, press_s: 600}\n"
    "control: {engage_at_start: true}\n";
constexpr int kFrames = 32;

class DaemonWithAPlayedCamera : public testing::TestWithParam<PlayedCamera> {
 protected:
  static rt::DepthModelParameters camera() {
    config::CameraSettings settings;
    settings.driver = "synthetic";
    settings.of<drivers::SyntheticSettings>().played = GetParam();
    return settings.effectiveDepthModel();
  }
};

TEST_P(DaemonWithAPlayedCamera, RecordsTheNoiseThatTheCameraStates) {
  const rt::DepthModelParameters camera = DaemonWithAPlayedCamera::camera();
  const DaemonHome home;
  Daemon daemon(home, kYaml,
                {"force.law=surface", "synthetic.camera=" + std::string(rt::wordOf(GetParam()))});
  ASSERT_TRUE(daemon.answers());
  // In contact the proxy is on the surface, which errs by less than a pixel does.
  json tick;
  ASSERT_TRUE(daemon.reaches([&tick](const json& status) {
    tick = status.at("tick");
    return status.at("mode") == "engaged" && !tick.at("proxyMInWorld").is_null() &&
           vectorOf(tick.at("commandForceNInWorld")).z > 0.2;
  }));
  EXPECT_NEAR(vectorOf(tick.at("proxyMInWorld")).z, -1, camera.noise.sigma_m(1)) << tick;

  ASSERT_EQ(home.control({"trace", "start", "--depth", "--label", "rest"}).ending, exitedWith(0));
  ASSERT_TRUE(
      daemon.reaches([](const json& status) { return status.at("trace").at("depthFrames") >= kFrames; }));
  const Finished stopped = home.control({"--json", "trace", "stop"});
  ASSERT_EQ(stopped.ending, exitedWith(0)) << stopped.errors;
  const std::string name = json::parse(stopped.output).at("name");
  EXPECT_EQ(daemon.terminate(), exitedWith(0));
  const fs::path recording = home.path() / "recording";
  const Finished exported = home.control({"trace", "export", (home.traceFolder() / (name + ".mcap")).string(),
                                          "--format", "recording", "--out", recording.string()});
  ASSERT_EQ(exported.ending, exitedWith(0)) << exported.errors;
  const auto reader = drivers::RecordingReader::open(recording, {0.1, 10});
  ASSERT_TRUE(reader) << reader.error().text();
  ASSERT_TRUE(reader->camera());
  EXPECT_EQ(reader->camera()->width_px, camera.width_px);
  EXPECT_EQ(reader->camera()->height_px, camera.height_px);
  EXPECT_EQ(reader->camera()->unit_m, camera.unit_m);
  EXPECT_NEAR(reader->camera()->noise.sigma_m(1), camera.noise.sigma_m(1), 1e-9);

  const fs::path report = home.path() / "noise.json";
  const Finished measured =
      runToEnd({HAPTICBENCH_PROGRAM, "noise", recording.string(), "--json", report.string()});
  ASSERT_EQ(measured.ending, exitedWith(0)) << measured.errors;
  EXPECT_TRUE(contains(measured.output, "% of the variance"));
  EXPECT_TRUE(contains(measured.output, "correlation  "));
  std::ifstream stream(report);
  const json document = json::parse(stream);
  // A tile of the measurement has 40 independent patches of a window of 5 pixels, and a plane takes 3 of
  // these.
  const json& noise = document.at("noise");
  const double sigma_m =
      noise.at("c0M").get<double>() + noise.at("c1").get<double>() + noise.at("c2PerM").get<double>();
  EXPECT_NEAR(sigma_m / camera.noise.sigma_m(1), 1, 0.1) << measured.output;
  EXPECT_NEAR(noise.at("staticShare").get<double>(), camera.noise.standing_share, 0.1) << measured.output;
  EXPECT_NEAR(noise.at("correlationPx").get<double>(), camera.noise.correlation_px, 1) << measured.output;
}

INSTANTIATE_TEST_SUITE_P(Kinds, DaemonWithAPlayedCamera,
                         testing::Values(PlayedCamera::stereo, PlayedCamera::time_of_flight),
                         [](const auto& kind) { return std::string(rt::wordOf(kind.param)); });

}  // namespace
}  // namespace hapticd::test
