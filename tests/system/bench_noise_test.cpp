// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "drivers/camera/recorded/camera_recording_writer.h"
#include "tests/support/program.h"
#include "tests/support/recording.h"
#include "tests/support/temporary_folder.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd {
namespace {

using nlohmann::json;

json noiseReport(const std::string& file) {
  std::ifstream stream(file);
  return json::parse(stream);
}

TEST(BenchNoise, ReportsTheNoiseOfARecordingForPeopleAndForPrograms) {
  const test::TemporaryFolder folder;
  const test::Recording room("03_raw11_room_static/room_static.tar.xz");
  const std::string report = (folder.path() / "noise.json").string();
  const test::Finished finished = test::runToEnd(
      {HAPTICBENCH_PROGRAM, "noise", room.path().string(), "--windows", "24,64", "--json", report});
  ASSERT_EQ(finished.ending, test::exitedWith(0)) << finished.errors;
  EXPECT_EQ(finished.errors, "");
  for (const char* part : {"window px", "static", "halves", "after 8"})
    EXPECT_NE(finished.output.find(part), std::string::npos) << part;

  const json document = noiseReport(report);
  ASSERT_EQ(document.at("windows").size(), 2U);
  for (const json& window : document.at("windows")) {
    const int windows_along = 632 / window.at("window_px").get<int>();
    const int windows_down = 480 / window.at("window_px").get<int>();
    const int counted = window.at("windows").get<int>() + window.at("with_holes").get<int>() +
                        window.at("not_smooth").get<int>() + window.at("moving").get<int>();
    EXPECT_EQ(counted, windows_along * windows_down);
    EXPECT_EQ(window.at("in_time_raw2").size(), 21U);
    EXPECT_EQ(window.at("in_space_raw2").size(), 17U);
  }
}

TEST(BenchNoise, MeasuresTheSyntheticCamerasSettings) {
  const test::TemporaryFolder folder;
  const std::string report = (folder.path() / "noise.json").string();
  double static_raw[2] = {};
  for (const int i : {0, 1}) {
    const test::Finished finished =
        test::runToEnd({HAPTICBENCH_PROGRAM, "noise", "--made-up", i == 0 ? "recorded" : "harsh", "--frames",
                        "16", "--windows", "64", "--json", report});
    ASSERT_EQ(finished.ending, test::exitedWith(0)) << finished.errors;
    const json document = noiseReport(report);
    EXPECT_EQ(document.at("frames"), 16);
    static_raw[i] = document.at("windows").at(0).at("standing_raw").at("value").get<double>();
  }
  EXPECT_LT(static_raw[0], static_raw[1]);
}

TEST(BenchNoise, FindsTheNoiseThatARecordingOfAnotherCameraWasMadeWith) {
  const rt::DepthModelParameters camera = tools::stereoCamera(424, 240, 69, 0.018, 0.0001, 0.07, 1.5);
  const test::TemporaryFolder folder;
  const auto recording = folder.path() / "recording";
  const auto writer = drivers::CameraRecordingWriter::create(
      recording, {.camera = camera, .near_m = {}, .far_m = {}, .serial = {}}, 0);
  ASSERT_TRUE(writer) << writer.error().text();
  constexpr std::uint32_t kFrames = 16;
  for (std::uint32_t number = 1; number <= kFrames; ++number) {
    const auto frame = tools::frameOf(camera, tools::tiltedPlane(camera, 0.5, 0.2), number);
    frame->arrival_ns = number * 33'000'000LL;
    ASSERT_TRUE((*writer)->write(*frame));
  }
  const std::string report = (folder.path() / "noise.json").string();
  const test::Finished finished =
      test::runToEnd({HAPTICBENCH_PROGRAM, "noise", recording.string(), "--json", report});
  ASSERT_EQ(finished.ending, test::exitedWith(0)) << finished.errors;
  EXPECT_NE(finished.output.find("16 frames of 424 x 240 pixels"), std::string::npos) << finished.output;
  EXPECT_NE(finished.output.find("noise_c2_per_m"), std::string::npos) << finished.output;
  const json document = noiseReport(report);
  EXPECT_EQ(document.at("frames"), kFrames);
  ASSERT_FALSE(document.at("noiseAtDepths").empty());
  for (const json& at : document.at("noiseAtDepths")) {
    const double depth_m = at.at("depthM");
    const double expected_m = camera.noise.c2_per_m * depth_m * depth_m;
    EXPECT_NEAR(at.at("changingM").get<double>(), expected_m, 0.1 * expected_m) << at;
    EXPECT_LT(at.at("standingM").get<double>(), 0.2 * expected_m) << at;
  }
  EXPECT_NEAR(document.at("noise").at("correlationPx").get<double>(), camera.noise.correlation_px, 1);

  const test::Finished windows =
      test::runToEnd({HAPTICBENCH_PROGRAM, "noise", recording.string(), "--windows", "24"});
  EXPECT_EQ(windows.ending, test::exitedWith(64));
  const test::Finished few =
      test::runToEnd({HAPTICBENCH_PROGRAM, "noise", recording.string(), "--first", "9"});
  EXPECT_EQ(few.ending, test::exitedWith(66));
  EXPECT_NE(few.errors.find("has 7 depth frames from frame 9 on"), std::string::npos) << few.errors;
}

TEST(BenchNoise, SaysWhatIsMissing) {
  const test::Finished nothing = test::runToEnd({HAPTICBENCH_PROGRAM, "noise"});
  EXPECT_EQ(nothing.ending, test::exitedWith(64));
  EXPECT_NE(nothing.errors.find("--made-up"), std::string::npos) << nothing.errors;
  const test::Finished absent = test::runToEnd({HAPTICBENCH_PROGRAM, "noise", "/nowhere/recording"});
  EXPECT_EQ(absent.ending, test::exitedWith(66));
  EXPECT_NE(absent.errors.find("/nowhere/recording"), std::string::npos) << absent.errors;
}

}  // namespace
}  // namespace hapticd
