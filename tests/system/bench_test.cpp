// SPDX-License-Identifier: Apache-2.0
// Each study of hapticbench from its command line to its report. What it measures is compared with oracles in
// tests/unit/tools.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "drivers/camera/recorded/recording_writer.h"
#include "tests/support/program.h"
#include "tests/support/recordings/depth_recording.h"
#include "tests/support/recordings/recording.h"
#include "tests/support/temporary_folder.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd {
namespace {

using nlohmann::json;
using test::exitedWith;
using test::Finished;

Finished bench(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), HAPTICBENCH_PROGRAM);
  return test::runToEnd(arguments);
}

/// A study that ended well: what people and what programs are told.
struct Reported {
  std::string text;
  json document;
};
Reported reportOf(std::vector<std::string> arguments) {
  const test::TemporaryFolder folder;
  const std::string file = (folder.path() / "report.json").string();
  arguments.insert(arguments.end(), {"--json", file});
  const Finished finished = bench(arguments);
  EXPECT_EQ(finished.ending, exitedWith(0)) << finished.errors;
  EXPECT_EQ(finished.errors, "");
  std::ifstream stream(file);
  return {finished.output, json::parse(stream, nullptr, /*allow_exceptions=*/false)};
}

/// The different values of a member of all rows.
std::set<std::string> valuesOf(const json& rows, const char* member) {
  std::set<std::string> values;
  for (const json& row : rows) values.insert(row.at(member).get<std::string>());
  return values;
}

void expectParts(const std::string& text, std::initializer_list<const char*> parts) {
  for (const char* part : parts) EXPECT_NE(text.find(part), std::string::npos) << part << " in\n" << text;
}

TEST(BenchAccuracy, ReportsEveryLawForPeopleAndForPrograms) {
  const auto [text, document] = reportOf({"accuracy", "--quick"});
  expectParts(text, {"nearest_springs", "smooth_springs", "proxy", "surface", "all scenes", "requirements"});
  EXPECT_EQ(valuesOf(document.at("rows"), "law").size(), 4U);
  for (const json& row : document.at("rows")) {
    EXPECT_GT(row.at("against_surface").at("samples").get<int>(), 0);
    EXPECT_EQ(row.at("pushes"), 1);
  }
  EXPECT_EQ(document.at("rows").size(),
            2U * 2U * (2U * 3U + 1U));  // scenes, noises, laws with and without filter, surface
  EXPECT_FALSE(document.at("requirements").empty());
}

TEST(BenchAccuracy, MeasuresOnlyWhatIsChosen) {
  const json rows = reportOf({"accuracy", "--quick", "--scenes", "bowl", "--laws", "proxy", "--distances",
                              "0.8", "--noises", "quantised"})
                        .document.at("rows");
  ASSERT_EQ(rows.size(), 2U);  // with and without filter
  for (const json& row : rows) {
    EXPECT_EQ(row.at("scene"), "bowl");
    EXPECT_EQ(row.at("law"), "proxy");
    EXPECT_EQ(row.at("noise"), "quantised");
    EXPECT_DOUBLE_EQ(row.at("distance_m").get<double>(), 0.8);
  }
}

TEST(BenchAccuracy, SaysSoWhereTheReportCannotBeWritten) {
  const Finished finished = bench({"accuracy", "--quick", "--scenes", "plane", "--laws", "nearest_springs",
                                   "--json", "/nowhere/report.json"});
  EXPECT_EQ(finished.ending, exitedWith(73));
  expectParts(finished.errors, {"/nowhere/report.json"});
}

TEST(BenchCameras, ReportsTheCostOfFramesOfEachSize) {
  const auto [text, document] = reportOf({"cameras", "--quick"});
  expectParts(text, {"tree/reach"});
  EXPECT_EQ(valuesOf(document.at("rows"), "camera").size(), 6U);
  for (const json& row : document.at("rows")) {
    EXPECT_GT(row.at("pixels_in_reach"), 100);
    EXPECT_GT(row.at("reach_ns"), 0);
    EXPECT_GT(row.at("surface_ns"), 0);
    EXPECT_GT(row.at("tree_ns"), row.at("reach_ns"));
  }
}

TEST(BenchFixtures, ReportsTheTimesOfTicksWithAndWithoutThem) {
  const auto [text, document] = reportOf({"fixtures", "--quick"});
  expectParts(text, {"more, p99.9"});
  ASSERT_EQ(document.at("rows").size(), 9U);
  for (const json& row : document.at("rows")) {
    EXPECT_GT(row.at("plain").at("median_ns"), 0);
    EXPECT_GE(row.at("added").at("p999_ns"), row.at("added").at("median_ns"));
    const std::string scene = row.at("scene");
    if (scene == "nothing" || scene == "apart") {
      EXPECT_EQ(row.at("acting_percent"), 0) << scene;
    } else {
      EXPECT_GT(row.at("acting_percent"), 5) << scene << ": the HIP meets what is measured";
    }
  }
}

TEST(BenchTracking, ReportsErrorsAndRefusals) {
  const auto [text, document] = reportOf({"tracking", "--quick"});
  expectParts(text, {"found %", "floor", "requirements"});
  ASSERT_EQ(document.at("rows").size(), 2U);
  for (const json& row : document.at("rows")) {
    const bool is_organ = row.at("solid") == "organ";
    // Nothing shows how a sphere is turned, so that its error has no floor and no result is accepted.
    EXPECT_EQ(row.at("accepted_percent"), is_organ ? 100 : 0);
    EXPECT_EQ(row.at("floor_m").is_null(), !is_organ);
    EXPECT_EQ(row.at("found_percent"), 100);
    EXPECT_GT(row.at("failures"), 0);
    const json& near = row.at("near_m").at("median");
    EXPECT_TRUE(is_organ ? near < 0.001 : near.is_null()) << near;
  }
}

TEST(BenchNoise, ReportsTheNoiseOfARecordingForPeopleAndForPrograms) {
  const test::Recording room("03_raw11_room_static/room_static.tar.xz");
  const auto [text, document] = reportOf({"noise", room.path().string()});
  expectParts(text, {"window px", "static", "halves", "after 8"});
  ASSERT_EQ(document.at("windows").size(), 4U);
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
  const auto static_raw = [](const char* setting) {
    const json document = reportOf({"noise", "--made-up", setting, "--frames", "16"}).document;
    EXPECT_EQ(document.at("frames"), 16);
    return document.at("windows").at(2).at("standing_raw").at("value").get<double>();
  };
  EXPECT_LT(static_raw("recorded"), static_raw("harsh"));
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
  const auto [text, document] = reportOf({"noise", recording.string()});
  expectParts(text, {"16 frames of 424 x 240 pixels", "noise_c2_per_m"});
  EXPECT_EQ(document.at("frames"), kFrames);
  ASSERT_FALSE(document.at("noiseAtDepths").empty());
  for (const json& at : document.at("noiseAtDepths")) {
    const double depth_m = at.at("depthM");
    const double expected_m = camera.noise.c2_per_m * depth_m * depth_m;
    EXPECT_NEAR(at.at("temporalM").get<double>(), expected_m, 0.1 * expected_m) << at;
    EXPECT_LT(at.at("staticM").get<double>(), 0.2 * expected_m) << at;
  }
  EXPECT_NEAR(document.at("noise").at("correlationPx").get<double>(), camera.noise.correlation_px, 1);
}

TEST(BenchNoise, SaysWhatIsMissing) {
  const Finished nothing = bench({"noise"});
  EXPECT_EQ(nothing.ending, exitedWith(64));
  expectParts(nothing.errors, {"--made-up"});
  const Finished absent = bench({"noise", "/nowhere/recording"});
  EXPECT_EQ(absent.ending, exitedWith(66));
  expectParts(absent.errors, {"/nowhere/recording"});
}

TEST(BenchBuzz, ReportsTheVibrationOfAContactAndItsLimits) {
  const auto [text, document] = reportOf({"buzz", "--quick"});
  expectParts(text, {"stroking", "requirements"});
  ASSERT_EQ(document.at("rows").size(), 1U);
  const json& row = document.at("rows").at(0);
  EXPECT_GT(row.at("rms_n"), 0);
  // 4 mm at 500 N/m; the harsher noise at 1 m moves a surface by much less than a millimetre
  EXPECT_NEAR(row.at("mean_force_n").get<double>(), 2, 0.5);
  EXPECT_EQ(document.at("requirements").size(), 2U);
}

TEST(BenchOcclusion, ReportsPassagesEntriesAndLimitsForPeopleAndForPrograms) {
  const auto [text, document] = reportOf({"occlusion", "--quick"});
  expectParts(text, {"requirements"});
  EXPECT_EQ(valuesOf(document.at("passages"), "law"), (std::set<std::string>{"auto", "proxy", "surface"}));
  EXPECT_EQ(document.at("passages").size(), 3U * 2U * 2U);  // laws, hands, gaps
  for (const json& row : document.at("entries")) {
    double shares = 0;
    for (const char* share : {"body", "none_reported", "none_silent", "wrong"})
      shares += row.at(share + std::string("_percent")).get<double>();
    EXPECT_NEAR(shares, 100, 1e-9) << row;
  }
  EXPECT_EQ(document.at("outlines").size(), 3U * 5U);  // laws, ways over a hand
  for (const json& row : document.at("outlines")) EXPECT_EQ(row.at("runs"), 1) << row;
  EXPECT_EQ(document.at("near").size(), 3U * 3U);  // laws, speeds
  for (const json& row : document.at("pushes")) EXPECT_GT(row.at("pushes"), 0) << row;
  EXPECT_FALSE(document.at("requirements").empty());
}

TEST(BenchOcclusion, MeasuresOnlyWhatIsChosen) {
  const json document =
      reportOf({"occlusion", "--quick", "--parts", "passages", "--laws", "proxy", "--distances", "1.2"})
          .document;
  ASSERT_EQ(document.at("passages").size(), 2U * 2U);  // hands, gaps
  for (const json& row : document.at("passages")) EXPECT_DOUBLE_EQ(row.at("wall_m").get<double>(), 1.2);
  EXPECT_TRUE(document.at("entries").empty());
}

TEST(BenchRecordings, ReportsEveryLawOnEverySessionOfAFolder) {
  const test::Recording recording("03_raw11_room_static/room_static.tar.xz");
  const test::TemporaryFolder folder;
  std::filesystem::create_directory_symlink(recording.path(), folder.path() / "a session");
  const auto [text, document] = reportOf({"recordings", "--quick", "--recordings", folder.path().string()});
  expectParts(text, {"requirements"});
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
  const auto [text, document] =
      reportOf({"recordings", "--quick", "--laws", "surface", "--recordings", folder.path().string()});
  expectParts(text, {"848 x 480"});
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
  const Finished finished = bench({"recordings", "--recordings", folder.path().string()});
  EXPECT_EQ(finished.ending, exitedWith(66));
  EXPECT_NE(finished.errors.find((recording / "frames.csv").string()), std::string::npos) << finished.errors;
}

TEST(BenchRecordings, SaysSoWhereThereAreNone) {
  const test::TemporaryFolder folder;
  const Finished finished = bench({"recordings", "--recordings", folder.path().string()});
  EXPECT_EQ(finished.ending, exitedWith(66));
  expectParts(finished.errors, {"--recordings"});
}

// "In closed loop, every law is stable wherever the theory says a spring of that stiffness is, within 10 %,
// or the deviation is explained by measurement."
TEST(BenchStability, FindsEachLawAsStableAsTheTheorySaysOrExplainsWhyNot) {
  constexpr double kAllowed = 0.1;
  const json limits = reportOf({"stability", "--quick"}).document.at("limits");
  ASSERT_EQ(limits.size(), 5U * 2U);  // laws and the reference, delays
  for (const json& limit : limits) {
    const double ratio =
        limit.at("found_n_per_m").get<double>() / limit.at("eigenvalue_n_per_m").get<double>();
    const std::string why = limit.at("explanation");
    EXPECT_TRUE(std::abs(ratio - 1) <= kAllowed || (!why.empty() && !why.starts_with("NOT")))
        << limit.at("law") << " " << ratio << " " << why;
    const bool constrains = limit.at("law") == "proxy" || limit.at("law") == "surface";
    EXPECT_TRUE(!constrains || std::abs(ratio - 1) <= kAllowed) << limit.at("law") << " " << ratio;
  }
}

TEST(BenchStrokes, ReportsEveryFigureForPeopleAndForPrograms) {
  const auto [text, document] = reportOf({"strokes", "--quick"});
  expectParts(text, {"proxy", "surface", "auto", "plane0", "rod40", "over_edge", "requirements"});
  for (const json& row : document.at("rows")) {
    EXPECT_EQ(row.at("strokes"), 1);
    EXPECT_GT(row.at("contact_ticks").get<int>(), 0);
    EXPECT_GT(row.at("free_ticks").get<int>(), 0);
    EXPECT_EQ(row.contains("end_mm"), row.at("scene") == "over_edge");
    EXPECT_EQ(row.at("error_by_floor").is_null(), row.at("noise") == "none");
  }
  EXPECT_EQ(valuesOf(document.at("rows"), "noise"), (std::set<std::string>{"none", "sensor", "harsh"}));
  EXPECT_EQ(document.at("rows").size(), 3U * 3U * 3U);  // scenes, noises, laws
  EXPECT_FALSE(document.at("requirements").empty());
}

}  // namespace
}  // namespace hapticd
