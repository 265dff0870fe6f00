// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "tests/support/depth_recording.h"
#include "tests/support/program.h"
#include "tests/support/recording.h"
#include "tests/support/temporary_folder.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd {
namespace {

using nlohmann::json;

TEST(BenchRecordings, ReportsEveryLawOnEverySessionOfAFolder) {
  const test::Recording recording("03_raw11_room_static/room_static.tar.xz");
  const test::TemporaryFolder folder;
  std::filesystem::create_directory_symlink(recording.path(), folder.path() / "a session");
  const std::string report = (folder.path() / "report.json").string();
  const test::Finished finished = test::runToEnd({HAPTICBENCH_PROGRAM, "recordings", "--quick",
                                                  "--recordings", folder.path().string(), "--json", report});
  ASSERT_EQ(finished.ending, test::exitedWith(0)) << finished.errors;
  EXPECT_EQ(finished.errors, "");
  EXPECT_NE(finished.output.find("requirements"), std::string::npos);
  std::ifstream file(report);
  const json document = json::parse(file);
  ASSERT_EQ(document.at("sessions").size(), 1U);
  const json& session = document.at("sessions").at(0);
  EXPECT_EQ(session.at("session"), "a session");
  ASSERT_FALSE(session.at("surfaces").empty());
  for (const json& row : session.at("surfaces")) {
    EXPECT_GT(row.at("fit_error_n").get<double>(), 0) << row;
    EXPECT_GT(row.at("stroke").at("ticks"), 0) << row;
    EXPECT_GT(row.at("still").at("new_frames"), 0) << row;
  }
  EXPECT_FALSE(document.at("requirements").empty());
}

TEST(BenchRecordings, FindsForcesWithinTheNoiseThatOtherCamerasState) {
  const std::pair<const char*, rt::DepthModelParameters> cameras[] = {
      {"stereo", tools::stereoCamera(848, 480, 90, 0.05, 1e-4, 0.4, 4)},
      {"time of flight", tools::timeOfFlightCamera(640, 576)}};
  constexpr int kFrames = 24;
  const test::TemporaryFolder folder;
  for (const auto& [name, camera] : cameras)
    test::writeDepthRecording(folder.path() / name, camera, tools::tiltedPlane(camera, 1, 0.2), kFrames);
  const test::TemporaryFolder reports;
  const std::string report = (reports.path() / "report.json").string();
  const test::Finished finished =
      test::runToEnd({HAPTICBENCH_PROGRAM, "recordings", "--quick", "--laws", "surface", "--recordings",
                      folder.path().string(), "--json", report});
  ASSERT_EQ(finished.ending, test::exitedWith(0)) << finished.errors;
  EXPECT_NE(finished.output.find("848 x 480"), std::string::npos) << finished.output;
  std::ifstream file(report);
  const json document = json::parse(file);
  ASSERT_EQ(document.at("sessions").size(), std::size(cameras));
  for (std::size_t i = 0; i < std::size(cameras); ++i) {
    const auto& [name, camera] = cameras[i];
    const json& session = document.at("sessions").at(i);
    EXPECT_EQ(session.at("session"), name);
    EXPECT_EQ(session.at("frames"), kFrames);
    EXPECT_EQ(session.at("camera").at("width_px"), camera.width_px);
    EXPECT_EQ(session.at("camera").at("principle"), rt::wordOf(camera.principle));
    ASSERT_FALSE(session.at("surfaces").empty()) << name;
    for (const json& row : session.at("surfaces")) {
      const double distance_m = row.at("distance_m");
      const double of_pixel_n = 500 * camera.noise.sigma_m(distance_m);
      // A surface is made of many pixels, so that it errs by less than one; by more than the mean over all of
      // the square, which is what the fit is made of.
      EXPECT_LT(row.at("fit_error_n"), 0.2 * of_pixel_n) << row;
      for (const char* hand : {"stroke", "still"}) {
        EXPECT_LT(row.at(hand).at("rms_n"), of_pixel_n) << row;
        EXPECT_GT(row.at(hand).at("rms_n"), 0) << row;
        EXPECT_EQ(row.at(hand).at("lost_percent"), 0) << row;
      }
    }
  }
  ASSERT_FALSE(document.at("requirements").empty());
  for (const json& requirement : document.at("requirements"))
    EXPECT_EQ(requirement.at("cases"), 0) << "of a Kinect alone: " << requirement;
}

TEST(BenchRecordings, NamesTheRecordingThatIsNone) {
  const rt::DepthModelParameters camera = tools::stereoCamera(424, 240, 90, 0.05, 1e-4, 0.4, 4);
  const test::TemporaryFolder folder;
  const std::filesystem::path recording = folder.path() / "without frames";
  test::writeDepthRecording(recording, camera, tools::tiltedPlane(camera, 1, 0), 1);
  std::filesystem::remove(recording / "frames.csv");
  const test::Finished finished =
      test::runToEnd({HAPTICBENCH_PROGRAM, "recordings", "--recordings", folder.path().string()});
  EXPECT_EQ(finished.ending, test::exitedWith(66));
  EXPECT_NE(finished.errors.find((recording / "frames.csv").string()), std::string::npos) << finished.errors;
}

TEST(BenchRecordings, SaysSoWhereThereAreNone) {
  const test::TemporaryFolder folder;
  const test::Finished finished =
      test::runToEnd({HAPTICBENCH_PROGRAM, "recordings", "--recordings", folder.path().string()});
  EXPECT_EQ(finished.ending, test::exitedWith(66));
  EXPECT_NE(finished.errors.find("--recordings"), std::string::npos);
}

}  // namespace
}  // namespace hapticd
