// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/support/recordings/depth_recording.h"
#include "tests/support/temporary_folder.h"
#include "tools/hapticbench/cost.h"
#include "tools/hapticbench/pareto.h"
#include "tools/lib/truth/any_camera.h"

namespace hapticd::tools {
namespace {

using rt::ForceLaw;
using rt::Vec3;

TEST(CpuCost, IsThirtyFramesAndAThousandForcesPerSecond) {
  CostSamples samples;
  samples.model_ns = {100'000, 300'000};            // mean 200 us: 6 ms per second
  samples.force_ns = {1'000, 2'000, 3'000, 4'000};  // mean 2.5 us: 2.5 ms per second
  EXPECT_DOUBLE_EQ(CpuCost::of(samples).cpu_ms_per_s(), 8.5);
}

TEST(CpuCost, GivesMedianTailAndLargestOfTheForces) {
  CostSamples samples;
  for (int us = 2000; us >= 0; --us) samples.force_ns.push_back(us * 1000);
  const CpuCost cost = CpuCost::of(samples);
  EXPECT_DOUBLE_EQ(cost.force_median_us, 1000);
  EXPECT_DOUBLE_EQ(cost.force_p999_us, 1998);
  EXPECT_DOUBLE_EQ(cost.force_max_us, 2000);
}

TEST(CpuCost, OfNothingIsNothing) {
  EXPECT_EQ(CpuCost::of({}).cpu_ms_per_s(), 0);
}

TEST(CostSamples, KeepTheFastestOfEachSampleOfTwoRuns) {
  CostSamples kept{{5, 7}, {1, 9, 3}};
  kept.keepLeast({{6, 2}, {2, 4, 3}});
  EXPECT_EQ(kept.model_ns, (std::vector<std::int64_t>{5, 2}));
  EXPECT_EQ(kept.force_ns, (std::vector<std::int64_t>{1, 4, 3}));
}

TEST(TouchingPath, IsNowhereFasterThanItsSpeedAndGoesThroughTheSurface) {
  const Vec3 inward{0, 0.6, -0.8};
  const Vec3 surface{0.1, 0.2, -1};
  const std::vector<Vec3> path = touchingPath(surface, inward, 1000);
  double fastest_m = 0, deepest_m = -1, farthest_m = 1;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const double depth_m = dot(path[i] - surface, inward);
    deepest_m = std::max(deepest_m, depth_m);
    farthest_m = std::min(farthest_m, depth_m);
    if (i > 0) fastest_m = std::max(fastest_m, norm(path[i] - path[i - 1]));
  }
  EXPECT_LE(fastest_m, kPathSpeed_m_per_s / 1000);
  EXPECT_GT(fastest_m, 0.9 * kPathSpeed_m_per_s / 1000);
  // of 2 Hz at 1 kHz every 500th tick and so the very turning points are there
  EXPECT_NEAR(deepest_m, 0.015, 1e-5);
  EXPECT_NEAR(farthest_m, -0.035, 1e-5);
}

TEST(TimedScenes, TakeRecordingsOfOtherCameras) {
  const rt::DepthModelParameters camera = stereoCamera(424, 240, 90, 0.05, 1e-4, 0.4, 4);
  const test::TemporaryFolder folder;
  test::writeDepthRecording(folder.path() / "stereo", camera, tiltedPlane(camera, 1.2, 0.3), 3);
  const auto scenes = timedScenes(folder.path().string());
  ASSERT_TRUE(scenes) << scenes.error().text();
  ASSERT_EQ(scenes->size(), 2U);  // the synthetic one is the first
  const TimedScene& scene = scenes->back();
  EXPECT_EQ(scene.name, "stereo");
  EXPECT_EQ(scene.camera, camera);
  // in the middle of the image, where the plane is 1.2 m away, but for the noise of a pixel
  EXPECT_NEAR(scene.surface_m.z, -1.2, 4 * camera.noise.sigma_m(1.2));
  EXPECT_LT(std::hypot(scene.surface_m.x, scene.surface_m.y), 1.3 / camera.fx_px);
  const auto costs = measureCosts(scene, {ours({})}, {.seconds = 0.1, .repeats = 1, .checks = 3});
  EXPECT_GT(costs.front().contacts, 0);
  EXPECT_GE(costs.front().largest_difference_n, 0);
  EXPECT_LT(costs.front().largest_difference_n, 1e-9);  // the reference, in double precision as ours

  const TimedScene jumping = scattered(scene, 200);
  ASSERT_EQ(jumping.path.size(), 200U);
  for (const Vec3& hip : jumping.path) {
    // Z = 1.2 - y tan 0.3 on the plane; offsets of 10 mm along each axis, and noise of a pixel
    const double off_m = (-hip.z - 1.2 + hip.y * std::tan(0.3)) * std::cos(0.3);
    EXPECT_LT(std::abs(off_m), 5 * (0.01 + camera.noise.sigma_m(-hip.z)));
  }
}

TEST(TimedScenes, RefuseARecordingOutOfReachByName) {
  const rt::DepthModelParameters camera = stereoCamera(424, 240, 90, 0.05, 1e-4, 0.4, 4);
  const test::TemporaryFolder folder;
  test::writeDepthRecording(folder.path() / "far away", camera, tiltedPlane(camera, 3, 0), 1);
  const auto scenes = timedScenes(folder.path().string());
  ASSERT_FALSE(scenes);
  EXPECT_NE(scenes.error().text().find((folder.path() / "far away").string()), std::string::npos);
}

TEST(LawsTable, HasOneSortedInitialiserPerLineUnderItsCommand) {
  const auto costs = [](double cpu_ms_per_s) {
    CpuCost cost;
    cost.force_mean_us = cpu_ms_per_s;  // of 1000 forces in a second
    return cost;
  };
  const LawSetting springs{};
  const LawSetting filtered_proxy{.law = ForceLaw::proxy, .filtered = true};
  const std::string table = lawsTable({{filtered_proxy, 3.5, 0.00189, costs(1.871)},
                                       {filtered_proxy, 0.8, 0.0002551, costs(5.644)},
                                       {springs, 1, 0.03364, costs(2.26)}},
                                      "tools/figures");
  EXPECT_EQ(table,
            "// SPDX-License-Identifier: Apache-2.0\n"
            "// Written by `tools/figures`.\n"
            "// law, filtered, noise m, RMS force error over stiffness m, pitch m, CPU ms per second of use\n"
            "{rt::ForceLaw::nearest_springs, false, 0.000937, 0.033640, 0.001683, 2.26},\n"
            "{rt::ForceLaw::proxy, true, 0.000599, 0.000255, 0.001346, 5.64},\n"
            "{rt::ForceLaw::proxy, true, 0.011474, 0.001890, 0.005890, 1.87},\n");
}

TEST(LawsTable, HoldsEveryLawAndFiltersThoseOnPoints) {
  const std::vector<LawSetting> settings = shippedSettings();
  EXPECT_EQ(settings.size(), 3U * 2U + 1U);  // laws on points filtered or not, surface
  EXPECT_TRUE(std::is_sorted(settings.begin(), settings.end()));
  for (const LawSetting& setting : settings) {
    EXPECT_EQ(setting.fusion_frames, rt::SurfaceParameters{}.fusion_frames);
    if (setting.law == ForceLaw::surface) {
      EXPECT_FALSE(setting.filtered);
    }
  }
  EXPECT_EQ(nameOf(allSettings().back()), "surface, 1 frame");
}

TEST(LawsTable, IsMeasuredForEverySettingAtEveryDistance) {
  const std::vector<LawAtDistance> rows =
      measureLaws({.distances_m = {0.8, 2}, .seconds = 0.07, .repeats = 1, .pushes = 1});
  EXPECT_EQ(rows.size(), 2 * shippedSettings().size());
  for (const LawAtDistance& row : rows) {
    EXPECT_GT(row.error_m, 0) << nameOf(row.setting);
    EXPECT_LT(row.error_m, 0.045) << nameOf(row.setting);  // springs push the wrong way by at most D_thresh,
                                                           // and the errors go 20 mm deep
    EXPECT_GT(row.cost.cpu_ms_per_s(), 0) << nameOf(row.setting);
  }
}

TEST(ErrorsOf, CountASettingThatIsNamedOnceOverAllScenes) {
  const LawSetting surface{.law = ForceLaw::surface};
  const auto errors = errorsOf({surface, {}}, 1, 1);
  ASSERT_EQ(errors.size(), 2U);
  // three scenes, one push each, compared at 5, 6, ... 20 mm
  EXPECT_NEAR(static_cast<double>(errors.at(surface).error_n.count()), 3 * 16, 3);
  EXPECT_LT(errors.at(surface).error_n.rms(), errors.at({}).error_n.rms());
}

TEST(DistanceErrors, AreGivenForEachLawNoiseDistanceAndKindInTurn) {
  const std::vector<DistanceError> errors = measureDistanceErrors({.laws = {"nearest_springs", "surface"},
                                                                   .distances_m = {0.6, 1},
                                                                   .noises = {SceneNoise::harsh},
                                                                   .kinds = {SurfaceKind::flat},
                                                                   .variants = 1});
  ASSERT_EQ(errors.size(), 4U);
  EXPECT_EQ(errors[1].law, "nearest_springs");
  EXPECT_EQ(errors[1].distance_m, 1);
  EXPECT_EQ(errors[2].law, "surface");
  EXPECT_EQ(errors[2].distance_m, 0.6);
  for (const DistanceError& error : errors) {
    ASSERT_TRUE(error.by_floor) << error.law;
    // springs that pull on where 4 N should hold err by more than these 4 N, 14 JND
    if (error.law == "nearest_springs") {
      EXPECT_GT(error.rms_jnd, 4 / 0.28);
    } else {
      EXPECT_LT(error.rms_jnd, 4 / 0.28);
    }
  }
}

TEST(SensorLimits, AreTheCamerasAndTheFloorsOfTheFactSheet) {
  const std::vector<SensorLimit> limits = sensorLimits({SceneNoise::harsh}, {1, 2});
  ASSERT_EQ(limits.size(), 2U);
  EXPECT_NEAR(limits[0].raw_unit_mm, 3.07, 0.01);   // |a| z^2, a of Table I
  EXPECT_NEAR(limits[1].raw_unit_mm, 12.28, 0.01);  // four times that
  EXPECT_NEAR(limits[1].narrowest_mm, 8 * 2000 / 594.2, 0.1);
  // the fact sheet's figures of that noise with 8 frames, to their last digit
  constexpr double kRounding_jnd = 0.05 + 1e-9;
  EXPECT_NEAR(limits[0].flat_40_mm_jnd, 0.8, kRounding_jnd);
  EXPECT_NEAR(limits[1].flat_40_mm_jnd, 5.2, kRounding_jnd);
  // of patches of 48 pixels the sheet's figures are up to 9 % lower (NoiseFloor)
  EXPECT_GE(limits[1].flat_160_mm_jnd, 1.6 - kRounding_jnd);
  EXPECT_LE(0.91 * limits[1].flat_160_mm_jnd, 1.6 + kRounding_jnd);
  // the sheet's 0.57 at 1 m is of a temporal noise of 0.25 raw units, not of 0.2 (NoiseFloor)
  EXPECT_NEAR(limits[0].ball_100_mm_jnd, 0.57, 0.15 * 0.57);
}

/// A short whole run without recordings.
const ParetoResult& shortRun() {
  static const ParetoResult result = [] {
    ParetoOptions options;
    options.recordings = "/nonexistent";
    options.settings = {{}, {.law = ForceLaw::surface}};
    options.cost = {.seconds = 0.1, .repeats = 2, .checks = 3};
    options.laws = {.distances_m = {1}, .seconds = 0.07, .repeats = 1, .pushes = 1};
    options.distances = {.laws = {"surface"},
                         .distances_m = {1},
                         .noises = {SceneNoise::harsh},
                         .kinds = {SurfaceKind::flat},
                         .variants = 1};
    options.evaluations = 40;
    options.pushes = 1;
    options.hard_frames = false;
    return measurePareto(options).value();
  }();
  return result;
}

TEST(Pareto, PutsEverySettingAndEveryLibraryBesideTheOthers) {
  const ParetoResult& result = shortRun();
  ASSERT_EQ(result.points.size(), 2 + libraries().size());
  EXPECT_GE(libraries().size(), 3U);
  for (const ParetoPoint& point : result.points) {
    EXPECT_EQ(point.run.samples.force_ns.size(), 100U) << point.run.kind.name;
    EXPECT_EQ(point.run.samples.model_ns.size(), 3U) << point.run.kind.name;  // 100 ms at 30 Hz
    EXPECT_GT(point.error.error_jnd.rms(), 0) << point.run.kind.name;
  }
}

TEST(Pareto, FindsTheSameForcesWithEveryWayToThePapersLaw) {
  // single precision at 1 m is 6e-8 m, times k_s is 3e-5 N; the libraries round point and HIP
  for (const ParetoPoint& point : shortRun().points) {
    if (!point.run.kind.is_paper_law) continue;
    EXPECT_GE(point.run.largest_difference_n, 0) << point.run.kind.name;
    EXPECT_LT(point.run.largest_difference_n, 1e-4) << point.run.kind.name;
    EXPECT_GT(point.run.contacts, 0) << point.run.kind.name;
  }
}

TEST(Pareto, ReportsTheSameFiguresForPeopleProgramsAndTheDocuments) {
  const ParetoResult& result = shortRun();
  const auto document = nlohmann::json::parse(paretoReport(result, 1).json());
  EXPECT_EQ(document.at("points").size(), result.points.size());
  EXPECT_EQ(document.at("evaluations").size(), 2U);
  const std::string table = paretoReport(result, 1).text();
  const std::string markdown = paretoMarkdown(result);
  for (const ParetoPoint& point : result.points) {
    EXPECT_NE(table.find(point.run.kind.name), std::string::npos);
    EXPECT_NE(markdown.find("| " + point.run.kind.name + " |"), std::string::npos);
  }
  // what to expect of a law at 1 m with the harsher camera, its cost there, and what the sensor allows
  EXPECT_NE(markdown.find("| law | camera | 1 m |\n|---|---|---:|\n| `surface` | harsher | "),
            std::string::npos);
  EXPECT_NE(markdown.find("| law and setting | 1 m |\n"), std::string::npos);
  EXPECT_NE(
      markdown.find("| the sensor | camera | 1 m |\n|---|---|---:|\n| one step of depth, mm | all | 3.1 |\n"),
      std::string::npos);
}

TEST(Pareto, GivesTheErrorOfTheLawSurfaceOverBothCameras) {
  ParetoResult result;
  const auto row = [](const char* law, SceneNoise noise, double distance_m, SurfaceKind kind, double jnd) {
    return DistanceError{
        .law = law, .noise = noise, .distance_m = distance_m, .kind = kind, .rms_jnd = jnd, .by_floor = {}};
  };
  result.distance_errors = {row("proxy", SceneNoise::sensor, 1, SurfaceKind::flat, 7),
                            row("surface", SceneNoise::sensor, 1, SurfaceKind::flat, 0.361),
                            row("surface", SceneNoise::sensor, 2, SurfaceKind::flat, 2.9),
                            row("surface", SceneNoise::sensor, 2, SurfaceKind::curved, 12.6),
                            row("surface", SceneNoise::harsh, 1, SurfaceKind::flat, 0.242),
                            row("surface", SceneNoise::harsh, 2, SurfaceKind::flat, 2.9)};
  EXPECT_EQ(surfaceErrorMarkdown(result),
            "| RMS error of `surface`, JND | 1 m | 2 m |\n|---|---:|---:|\n"
            "| flat surface | 0.24 to 0.36 | 2.9 |\n"
            "| curved surface | - | 13 |\n"
            "| moving surface | - | - |\n");
}

TEST(Pareto, DrawsEveryPointOnce) {
  const std::string script = plotScript(shortRun(), "it's.svg");
  EXPECT_NE(script.find("set terminal svg"), std::string::npos);
  EXPECT_NE(script.find("set logscale xy"), std::string::npos);
  for (const char* name : {"surface", "nanoflann"}) {
    const std::string labelled = fmt::format(" \"{}\"\n", name);
    const std::size_t first = script.find(labelled);
    EXPECT_NE(first, std::string::npos) << name;
    EXPECT_EQ(script.find(labelled, first + 1), std::string::npos) << name;
  }
}

TEST(Pareto, SaysWhichRequirementIsNotMet) {
  ParetoResult result;
  result.evaluations = {{"scene", true, 10, 0.5, 0.25}, {"scene", false, 10, 2.5, 0.1}};
  result.hard_frames = {{"frame", "law", 150, 900}, {"frame", "other law", 210, 900}};
  const auto requirements = requirementsOf(result);
  ASSERT_EQ(requirements.size(), 4U);
  EXPECT_DOUBLE_EQ(requirements[0].measured, 40);  // surface, the least of both motions
  EXPECT_FALSE(requirements[0].met());
  EXPECT_DOUBLE_EQ(requirements[1].measured, 4);  // unrelated
  EXPECT_FALSE(requirements[1].met());
  EXPECT_DOUBLE_EQ(requirements[2].measured, 20);  // along the path
  EXPECT_TRUE(requirements[2].met());
  EXPECT_DOUBLE_EQ(requirements[3].measured, 21);  // per cent of 1000 us
  EXPECT_FALSE(requirements[3].met());
}

}  // namespace
}  // namespace hapticd::tools
