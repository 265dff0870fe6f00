// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "tools/hapticbench/pareto/pareto_study.h"

namespace hapticd::tools {
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
