#include "tools/hapticbench/pareto/pareto_study.h"

#include <algorithm>
#include <limits>

#include "tools/hapticbench/pareto/hard_frames.h"
#include "tools/hapticbench/pareto/setting_error.h"

namespace hapticd::tools {
namespace {

using rt::ForceLaw;

using Progress = std::function<void(const std::string&)>;

constexpr double kTick_us = 1e6 / kTicksPerSecond;

void tell(const Progress& progress, const std::string& what) {
  if (progress) progress(what);
}

std::vector<ParetoPoint> pointsOf(const std::vector<TimedScene>& scenes, const ParetoOptions& options,
                                  const Progress& progress) {
  std::vector<ContenderKind> kinds;
  for (const LawSetting& setting : options.settings) kinds.push_back(ours(setting));
  for (const ContenderKind& library : libraries()) kinds.push_back(library);
  std::vector<ContenderCost> sum;
  for (const TimedScene& scene : scenes) {
    tell(progress, "times on " + scene.name);
    addCosts(sum, measureCosts(scene, kinds, options.cost));
  }
  constexpr double kDistance_m = 1;
  tell(progress, "errors");
  std::vector<LawSetting> settings = options.settings;
  settings.push_back({});  // the paper's law, for the libraries
  const ErrorsOfSettings errors =
      errorsOf(settings, {"plane", "sphere", "moving_0.1"}, kDistance_m, options.pushes);
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
    tell(progress, "single forces on " + scene.name);
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
  for (const ForceLaw law : kAllLaws) {
    for (const bool filtered : {false, true}) kinds.push_back(ours({.law = law, .filtered = filtered}));
  }
  std::vector<HardFrameRow> rows;
  for (const TimedScene& scene : hardFrames()) {
    tell(progress, "hard frame: " + scene.name);
    // the largest of many is what an interruption changes most: twice the runs
    for (const ContenderCost& cost : measureCosts(scene, kinds, {0, 2 * options.cost.repeats, 0})) {
      const CpuCost worst = CpuCost::of(cost.samples);
      rows.push_back({scene.name, cost.kind.name, worst.force_max_us, worst.model_max_us});
    }
  }
  return rows;
}

void addEvaluationRequirements(const ParetoResult& result, std::vector<ParetoRequirement>& requirements) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  double surface = kNone, unrelated = kNone, path = kNone;
  for (const EvaluationRow& row : result.evaluations) {
    surface = std::min(surface, row.nanoflann_us / row.surface_us);
    double& least = row.along_path ? path : unrelated;
    least = std::min(least, row.nanoflann_us / row.nearest_springs_us);
  }
  if (result.evaluations.empty()) return;
  requirements.push_back(
      {"one force of surface cheaper than nanoflann's 100 nearest, times", surface, 50, true});
  requirements.push_back(
      {"one force of nearest_springs at an unrelated position cheaper than nanoflann's, times", unrelated, 6,
       true});
  requirements.push_back(
      {"one force of nearest_springs along a motion of up to 1 m/s cheaper than nanoflann's, times", path, 20,
       true});
}

}  // namespace

config::Result<ParetoResult> measurePareto(const ParetoOptions& options, const Progress& progress) {
  const auto scenes = timedScenes(options.recordings);
  if (!scenes) return std::unexpected(scenes.error());
  ParetoResult result;
  for (const TimedScene& scene : *scenes) result.scenes.push_back(scene.name);
  result.points = pointsOf(*scenes, options, progress);
  if (options.evaluations > 0) result.evaluations = evaluationsOf(*scenes, options, progress);
  if (options.hard_frames) result.hard_frames = hardFrameRows(options, progress);
  return result;
}

std::vector<ParetoRequirement> requirementsOf(const ParetoResult& result) {
  std::vector<ParetoRequirement> requirements;
  const auto ours_at = std::find_if(result.points.begin(), result.points.end(), [](const ParetoPoint& point) {
    return point.run.kind.is_ours && point.run.kind.is_paper_law;
  });
  if (ours_at != result.points.end()) {
    for (const ParetoPoint& point : result.points) {
      if (point.run.kind.is_ours) continue;
      requirements.push_back(
          {"nearest_springs takes less CPU per second of use than " + point.run.kind.name + ", times",
           point.cost.cpu_ms_per_s() / ours_at->cost.cpu_ms_per_s(), 10, true});
    }
    requirements.push_back({"largest difference of nearest_springs from the reference, N",
                            ours_at->run.largest_difference_n, 1e-4, false});
  }
  addEvaluationRequirements(result, requirements);
  double worst_us = 0;
  for (const HardFrameRow& row : result.hard_frames) worst_us = std::max(worst_us, row.force_max_us);
  if (!result.hard_frames.empty()) {
    requirements.push_back(
        {"dearest force on any hard frame, share of the tick in %", 100 * worst_us / kTick_us, 20, false});
  }
  return requirements;
}

}  // namespace hapticd::tools
