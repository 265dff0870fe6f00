// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/pareto/pareto_study.h"

#include <algorithm>

#include "tools/hapticbench/pareto/hard_frames.h"

namespace hapticd::tools {
namespace {

using rt::ForceLaw;

using Progress = std::function<void(const std::string&)>;

void report(const Progress& progress, const std::string& what) {
  if (progress) progress(what);
}

std::vector<ParetoPoint> pointsOf(const std::vector<TimedScene>& scenes, const ParetoOptions& options,
                                  const Progress& progress) {
  std::vector<ContenderKind> kinds;
  for (const LawSetting& setting : options.settings) kinds.push_back(ours(setting));
  for (const ContenderKind& library : libraries()) kinds.push_back(library);
  std::vector<ContenderCost> sum;
  for (const TimedScene& scene : scenes) {
    report(progress, "times on " + scene.name);
    addCosts(sum, measureCosts(scene, kinds, options.cost));
  }
  constexpr double kDistance_m = 1;
  report(progress, "errors");
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

std::vector<EvaluationRow> evaluationsOf(const std::vector<TimedScene>& scenes, const ParetoOptions& options,
                                         const Progress& progress) {
  const std::vector<ContenderKind> all = libraries();
  const auto nanoflann = std::find_if(all.begin(), all.end(),
                                      [](const ContenderKind& kind) { return kind.name == "nanoflann"; });
  const std::vector<ContenderKind> kinds{*nanoflann, ours({}), ours({.law = ForceLaw::surface})};
  std::vector<EvaluationRow> rows;
  for (const TimedScene& scene : scenes) {
    report(progress, "single forces on " + scene.name);
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

std::vector<HardFrameRow> hardFrameRows(const ParetoOptions& options, const Progress& progress) {
  std::vector<ContenderKind> kinds;
  for (const LawSetting& setting : shippedSettings()) kinds.push_back(ours(setting));
  std::vector<HardFrameRow> rows;
  for (const TimedScene& scene : hardFrames()) {
    report(progress, "hard frame: " + scene.name);
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

config::Result<ParetoResult> measurePareto(const ParetoOptions& options, const Progress& progress) {
  const auto scenes = timedScenes(options.recordings);
  if (!scenes) return std::unexpected(scenes.error());
  ParetoResult result;
  for (const TimedScene& scene : *scenes) result.scenes.push_back(scene.name);
  result.points = pointsOf(*scenes, options, progress);
  result.laws = measureLaws(options.laws, progress);
  result.distance_errors = measureDistanceErrors(options.distances, progress);
  result.sensor_limits = sensorLimits(options.distances.noises, options.distances.distances_m);
  if (options.evaluations > 0) result.evaluations = evaluationsOf(*scenes, options, progress);
  if (options.hard_frames) result.hard_frames = hardFrameRows(options, progress);
  return result;
}

}  // namespace hapticd::tools
