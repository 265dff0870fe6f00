// SPDX-License-Identifier: Apache-2.0
// The daemon with each camera that the synthetic camera plays: what the hand feels, and what a recording of
// it at rest shows of the camera's noise.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "config/settings/settings.h"
#include "drivers/camera/recorded/recording_reader.h"
#include "drivers/camera/synthetic/analytic_scene.h"
#include "tests/system/support/daemon_under_test.h"

namespace hapticd::test {
namespace {

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
