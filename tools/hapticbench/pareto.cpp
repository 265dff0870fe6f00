// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/pareto.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <tuple>

#include "config/settings/law_choice.h"
#include "rt/base/parameters.h"
#include "tools/hapticbench/accuracy.h"
#include "tools/hapticbench/cost.h"
#include "tools/hapticbench/engine/study.h"
#include "tools/hapticbench/strokes/strokes.h"
#include "tools/lib/truth/noise_floor.h"

namespace hapticd::tools {
namespace {

/// Returns a row as a line of the table, with as many decimals as repeated measurements agree in.
std::string lineOf(const LawAtDistance& row) {
  const config::SurfaceAsSeen seen = config::asSeenBy(rt::DepthModelParameters{}, row.distance_m);
  return fmt::format("{{rt::ForceLaw::{}, {}, {:.6f}, {:.6f}, {:.6f}, {:.2f}}},\n", nameOf(row.setting.law),
                     row.setting.filtered, seen.noise_m, row.error_m, seen.pitch_m, row.cost.cpu_ms_per_s());
}

}  // namespace

std::string lawsTable(std::vector<LawAtDistance> rows, const std::string& command) {
  std::ranges::sort(rows, {}, [](const LawAtDistance& row) { return std::tie(row.setting, row.distance_m); });
  fmt::memory_buffer text;
  fmt::format_to(std::back_inserter(text),
                 "// SPDX-License-Identifier: Apache-2.0\n// Written by `{}`.\n// law, filtered, noise m, "
                 "RMS force error over stiffness m, pitch m, CPU ms "
                 "per second of use\n",
                 command);
  for (const LawAtDistance& row : rows) fmt::format_to(std::back_inserter(text), "{}", lineOf(row));
  return fmt::to_string(text);
}

std::map<LawSetting, ForceErrors> errorsOf(const std::vector<LawSetting>& settings, double distance_m,
                                           int pushes) {
  AccuracyOptions options;
  options.scenes = {"plane", "sphere", "plane30"};
  options.settings = settings;
  options.distances_m = {distance_m};
  options.noises = {SceneNoise::harsh};
  options.pushes = pushes;
  options.hold_frames = 0;
  std::map<LawSetting, ForceErrors> errors;
  for (const AccuracyRow& row : measureAccuracy(options)) errors[row.setting].add(row.error);
  return errors;
}

std::vector<LawAtDistance> measureLaws(const LawsTableOptions& options) {
  const std::vector<LawSetting> settings = shippedSettings();
  std::vector<ContenderKind> kinds;
  for (const LawSetting& setting : settings) kinds.push_back(ours(setting));
  std::vector<LawAtDistance> rows;
  for (const double distance_m : options.distances_m) {
    showProgress(fmt::format("laws at {} m", distance_m));
    const auto errors = errorsOf(settings, distance_m, options.pushes);
    const std::vector<ContenderCost> costs =
        measureCosts(slopeAt(distance_m), kinds, {options.seconds, options.repeats, 0});
    for (std::size_t i = 0; i < settings.size(); ++i) {
      rows.push_back({settings[i], distance_m,
                      errors.at(settings[i]).error_n.rms() / rt::SpringParameters{}.stiffness_n_per_m,
                      CpuCost::of(costs[i].samples)});
    }
  }
  return rows;
}

namespace {

std::vector<std::string> scenesOf(SurfaceKind kind) {
  switch (kind) {
    case SurfaceKind::flat:
      return {"plane0", "plane30"};
    case SurfaceKind::curved:
      return {"sphere100", "rod80"};
    case SurfaceKind::moving:
      return {"moving0.3"};
  }
  return {};
}

/// Sums rows that belong to the same law, noise, distance and kind of surface.
DistanceError summed(const std::vector<StrokesRow>& rows, const DistanceError& like) {
  StrokesRow sum;
  sum.noise = like.noise;
  for (const StrokesRow& row : rows) {
    if (row.law != like.law || row.noise != like.noise || row.distance_m != like.distance_m) continue;
    sum.figures.add(row.figures);
    sum.floor_n.add(row.floor_n);
  }
  DistanceError error = like;
  error.rms_jnd = sum.figures.error.error_jnd.rms();
  error.lost_percent = sum.figures.lostPercent();
  error.by_floor = sum.errorByFloor();
  return error;
}

template <typename Surface>
double floor_jnd(SceneNoise noise, const Surface& surface) {
  return noiseFloor(sensorParameters(noise), {}, surface, rt::SpringParameters{}.stiffness_n_per_m).force_jnd;
}

/// A place on a flat surface that faces the camera.
FloorPatch flat(double side_m, double distance_m) {
  return {.side_m = side_m, .distance_m = distance_m};
}

/// The foremost place of a ball on the optical axis.
FloorBody ballAt(double distance_m) {
  return {.contact_m = {0, 0, -distance_m}, .outward = {0, 0, 1}, .radius_m = 0.05};
}

}  // namespace

std::vector<DistanceError> measureDistanceErrors(const DistanceErrorOptions& options) {
  StrokesOptions strokes;
  strokes.laws = options.laws;
  strokes.distances_m = options.distances_m;
  strokes.noises = options.noises;
  strokes.variants = options.variants;
  strokes.seeds = 1;
  std::vector<std::vector<StrokesRow>> rows;
  for (const SurfaceKind kind : options.kinds) {
    strokes.scenes = scenesOf(kind);
    rows.push_back(measureStrokes(strokes));
  }
  std::vector<DistanceError> likes{{}};
  likes = varied(likes, &DistanceError::law, options.laws);
  likes = varied(likes, &DistanceError::noise, options.noises);
  likes = varied(likes, &DistanceError::distance_m, options.distances_m);
  std::vector<DistanceError> errors;
  for (DistanceError& like : likes) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      like.kind = options.kinds[i];
      errors.push_back(summed(rows[i], like));
    }
  }
  return errors;
}

std::vector<SensorLimit> sensorLimits(const std::vector<SceneNoise>& noises,
                                      const std::vector<double>& distances_m) {
  constexpr double kPixelsOfBody = 8;
  const rt::DepthModelParameters camera;
  std::vector<SensorLimit> limits;
  for (const SceneNoise noise : noises) {
    for (const double distance_m : distances_m) {
      limits.push_back({.noise = noise,
                        .distance_m = distance_m,
                        .raw_unit_mm = 1000 * std::abs(camera.a_per_m) * distance_m * distance_m,
                        .narrowest_mm = 1000 * kPixelsOfBody * distance_m / camera.fx_px,
                        .flat_40_mm_jnd = floor_jnd(noise, flat(0.04, distance_m)),
                        .flat_160_mm_jnd = floor_jnd(noise, flat(0.16, distance_m)),
                        .ball_100_mm_jnd = floor_jnd(noise, ballAt(distance_m))});
    }
  }
  return limits;
}

namespace {

using rt::ForceLaw;

std::vector<ParetoPoint> pointsOf(const std::vector<TimedScene>& scenes, const ParetoOptions& options) {
  std::vector<ContenderKind> kinds;
  for (const LawSetting& setting : options.settings) kinds.push_back(ours(setting));
  for (const ContenderKind& library : libraries()) kinds.push_back(library);
  std::vector<ContenderCost> sum;
  for (const TimedScene& scene : scenes) {
    showProgress("times on " + scene.name);
    addCosts(sum, measureCosts(scene, kinds, options.cost));
  }
  constexpr double kDistance_m = 1;
  showProgress("errors");
  std::vector<LawSetting> settings = options.settings;
  // the paper's law, for the libraries
  if (std::ranges::find(settings, LawSetting{}) == settings.end()) settings.push_back({});
  const auto errors = errorsOf(settings, kDistance_m, options.pushes);
  std::vector<ParetoPoint> points;
  for (ContenderCost& run : sum) {
    const CpuCost cost = CpuCost::of(run.samples);
    const ForceErrors& error = errors.at(run.kind.setting);
    points.push_back({std::move(run), cost, error});
  }
  return points;
}

std::vector<EvaluationRow> evaluationsOf(const std::vector<TimedScene>& scenes,
                                         const ParetoOptions& options) {
  const std::vector<ContenderKind> all = libraries();
  const auto nanoflann = std::find_if(all.begin(), all.end(),
                                      [](const ContenderKind& kind) { return kind.name == "nanoflann"; });
  const std::vector<ContenderKind> kinds{*nanoflann, ours({}), ours({.law = ForceLaw::surface})};
  std::vector<EvaluationRow> rows;
  for (const TimedScene& scene : scenes) {
    showProgress("single forces on " + scene.name);
    for (const bool along_path : {false, true}) {
      const TimedScene moved =
          along_path ? fast(scene, options.evaluations) : scattered(scene, options.evaluations);
      const std::vector<ContenderCost> costs = measureCosts(moved, kinds, {0, options.cost.repeats, 0});
      const auto median_us = [&costs](std::size_t i) {
        return CpuCost::of(costs[i].samples).force_median_us;
      };
      rows.push_back({scene.name, along_path, median_us(0), median_us(1), median_us(2)});
    }
  }
  return rows;
}

std::vector<HardFrameRow> hardFrameRows(const ParetoOptions& options) {
  std::vector<ContenderKind> kinds;
  for (const LawSetting& setting : shippedSettings()) kinds.push_back(ours(setting));
  std::vector<HardFrameRow> rows;
  for (const TimedScene& scene : hardFrames()) {
    showProgress("hard frame: " + scene.name);
    // the largest of many is what an interruption changes most: twice the runs
    for (const ContenderCost& cost : measureCosts(scene, kinds, {0, 2 * options.cost.repeats, 0})) {
      const CpuCost worst = CpuCost::of(cost.samples);
      rows.push_back({scene.name, cost.kind.name, worst.force_max_us, worst.model_max_us});
    }
  }
  return rows;
}

}  // namespace

std::vector<LawSetting> allSettings() {
  std::vector<LawSetting> settings = shippedSettings();
  settings.push_back({.law = ForceLaw::surface, .fusion_frames = 1});
  return settings;
}

base::Result<ParetoResult> measurePareto(const ParetoOptions& options) {
  const auto scenes = timedScenes(options.recordings);
  if (!scenes) return std::unexpected(scenes.error());
  ParetoResult result;
  for (const TimedScene& scene : *scenes) result.scenes.push_back(scene.name);
  result.points = pointsOf(*scenes, options);
  result.laws = measureLaws(options.laws);
  result.distance_errors = measureDistanceErrors(options.distances);
  result.sensor_limits = sensorLimits(options.distances.noises, options.distances.distances_m);
  if (options.evaluations > 0) result.evaluations = evaluationsOf(*scenes, options);
  if (options.hard_frames) result.hard_frames = hardFrameRows(options);
  return result;
}

namespace {

using Requirements = std::vector<Requirement>;

constexpr double kTick_us = 1e6 / kTicksPerSecond;
constexpr double kFarthest_m = 2;  // of the limits on errors

void addComparisons(const ParetoResult& result, Requirements& list) {
  const auto ours_at = std::ranges::find_if(result.points, [](const ParetoPoint& point) {
    return point.run.kind.is_ours && point.run.kind.is_paper_law;
  });
  if (ours_at == result.points.end()) return;
  for (const ParetoPoint& point : result.points) {
    if (point.run.kind.is_ours) continue;
    list.push_back(Requirement::atLeast(
        "", "nearest_springs takes less CPU per second of use than " + point.run.kind.name + ", times", 10,
        point.cost.cpu_ms_per_s() / ours_at->cost.cpu_ms_per_s()));
  }
  list.push_back(Requirement::atMost("", "largest difference of nearest_springs from the reference, N", 1e-4,
                                     ours_at->run.largest_difference_n));
}

void addEvaluations(const ParetoResult& result, Requirements& list) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  double surface = kNone, unrelated = kNone, path = kNone;
  for (const EvaluationRow& row : result.evaluations) {
    surface = std::min(surface, row.nanoflann_us / row.surface_us);
    double& least = row.along_path ? path : unrelated;
    least = std::min(least, row.nanoflann_us / row.nearest_springs_us);
  }
  if (result.evaluations.empty()) return;
  const auto add = [&list](const char* text, double limit, double measured) {
    list.push_back(Requirement::atLeast("", text, limit, measured));
  };
  add("one force of surface cheaper than nanoflann's 100 nearest, times", 50, surface);
  add("one force of nearest_springs at an unrelated position cheaper than nanoflann's, times", 6, unrelated);
  add("one force of nearest_springs along a motion of up to 1 m/s cheaper than nanoflann's, times", 20, path);
}

/// Adds limits of the cost of a frame, a force and a second of use of the law `surface`.
void addSurfaceCosts(const ParetoResult& result, Requirements& list) {
  for (const double distance_m : kCostDistances_m) {
    for (const LawAtDistance& row : result.laws) {
      if (row.setting.law != rt::ForceLaw::surface || row.distance_m != distance_m) continue;
      const std::string of_surface = fmt::format("surface at {:g} m: ", distance_m);
      list.push_back(
          Requirement::atMost("", of_surface + "median of a frame, us", 60, row.cost.model_median_us));
      list.push_back(
          Requirement::atMost("", of_surface + "median of a force, us", 0.5, row.cost.force_median_us));
      list.push_back(
          Requirement::atMost("", of_surface + "CPU, ms per s of use", 2.5, row.cost.cpu_ms_per_s()));
    }
  }
}

/// Errors of the law `surface` with real noise.
void addSurfaceErrors(const ParetoResult& result, Requirements& list) {
  constexpr double kOneJnd_m = 1.2;
  const auto add = [&](const char* text, double limit, auto figure) {
    double largest = -1;
    for (const DistanceError& row : result.distance_errors) {
      if (row.law == "surface" && row.distance_m <= kFarthest_m) largest = std::max(largest, figure(row));
    }
    if (largest >= 0) list.push_back(Requirement::atMost("", text, limit, largest));
  };
  add("surface: RMS error on flat surfaces to 1.2 m, JND", 1, [](const DistanceError& row) {
    return row.kind == SurfaceKind::flat && row.distance_m <= kOneJnd_m ? row.rms_jnd : -1;
  });
  add("surface: RMS error on a plane at 0.3 m/s at 1 m, JND", 1, [](const DistanceError& row) {
    return row.kind == SurfaceKind::moving && row.distance_m == 1 ? row.rms_jnd : -1;
  });
  add("surface: RMS error over the sensor's floor to 2 m, times", 1.3,
      [](const DistanceError& row) { return row.by_floor.value_or(-1); });
  add("surface: contact lost on flat surfaces to 2 m, %", 0,
      [](const DistanceError& row) { return row.kind == SurfaceKind::flat ? row.lost_percent : -1; });
}

}  // namespace

std::vector<Requirement> requirementsOf(const ParetoResult& result) {
  Requirements list;
  addComparisons(result, list);
  addEvaluations(result, list);
  addSurfaceCosts(result, list);
  addSurfaceErrors(result, list);
  double worst_us = 0;
  for (const HardFrameRow& row : result.hard_frames) worst_us = std::max(worst_us, row.force_max_us);
  if (!result.hard_frames.empty()) {
    list.push_back(Requirement::atMost("",
                                       "largest cost of one force on any hard frame, share of the tick in %",
                                       20, 100 * worst_us / kTick_us));
  }
  return list;
}

}  // namespace hapticd::tools
