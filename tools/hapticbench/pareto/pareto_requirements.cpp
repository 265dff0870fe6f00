// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <string>

#include <fmt/format.h>

#include "tools/hapticbench/pareto/pareto_study.h"

namespace hapticd::tools {
namespace {

constexpr double kTick_us = 1e6 / kTicksPerSecond;
constexpr double kFarthest_m = 2;  // that bounds on errors and costs are for

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

/// What a frame, a force and a second of use of the law `surface` may cost.
void addSurfaceCosts(const ParetoResult& result, std::vector<ParetoRequirement>& requirements) {
  constexpr double kFrame_us = 60;
  constexpr double kForce_us = 0.5;
  constexpr double kCpu_ms_per_s = 2.5;
  for (const double distance_m : kCostDistances_m) {
    for (const LawAtDistance& row : result.laws) {
      if (row.setting.law != rt::ForceLaw::surface || row.distance_m != distance_m) continue;
      const std::string of_surface = fmt::format("surface at {:g} m: ", distance_m);
      requirements.push_back(
          {of_surface + "median of a frame, us", row.cost.model_median_us, kFrame_us, false});
      requirements.push_back(
          {of_surface + "median of a force, us", row.cost.force_median_us, kForce_us, false});
      requirements.push_back(
          {of_surface + "CPU, ms per s of use", row.cost.cpu_ms_per_s(), kCpu_ms_per_s, false});
    }
  }
}

/// Errors of the law `surface` with real noise.
void addSurfaceErrors(const ParetoResult& result, std::vector<ParetoRequirement>& requirements) {
  constexpr double kOneJnd_m = 1.2;
  constexpr double kOverFloor = 1.3;
  double flat_jnd = -1, moving_jnd = -1, by_floor = -1, lost_percent = -1;
  for (const DistanceError& row : result.distance_errors) {
    if (row.law != "surface" || row.distance_m > kFarthest_m) continue;
    by_floor = std::max(by_floor, row.by_floor.value_or(-1));
    if (row.kind == SurfaceKind::flat) lost_percent = std::max(lost_percent, row.lost_percent);
    if (row.distance_m > kOneJnd_m) continue;
    if (row.kind == SurfaceKind::flat) flat_jnd = std::max(flat_jnd, row.rms_jnd);
    if (row.kind == SurfaceKind::moving && row.distance_m == 1)
      moving_jnd = std::max(moving_jnd, row.rms_jnd);
  }
  const auto add = [&requirements](const char* text, double measured, double limit) {
    if (measured >= 0) requirements.push_back({text, measured, limit, false});
  };
  add("surface: RMS error on flat surfaces to 1.2 m, JND", flat_jnd, 1);
  add("surface: RMS error on a plane at 0.3 m/s at 1 m, JND", moving_jnd, 1);
  add("surface: RMS error over the sensor's floor to 2 m, times", by_floor, kOverFloor);
  add("surface: contact lost on flat surfaces to 2 m, %", lost_percent, 0);
}

}  // namespace

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
  addSurfaceCosts(result, requirements);
  addSurfaceErrors(result, requirements);
  double worst_us = 0;
  for (const HardFrameRow& row : result.hard_frames) worst_us = std::max(worst_us, row.force_max_us);
  if (!result.hard_frames.empty()) {
    requirements.push_back(
        {"dearest force on any hard frame, share of the tick in %", 100 * worst_us / kTick_us, 20, false});
  }
  return requirements;
}

}  // namespace hapticd::tools
