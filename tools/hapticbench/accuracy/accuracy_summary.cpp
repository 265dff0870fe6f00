// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/accuracy/accuracy_summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tools/hapticbench/accuracy/spring_truth.h"

namespace hapticd::tools {
namespace {

using rt::ForceLaw;

std::string placeOf(const AccuracyRow& row) {
  return fmt::format("{} on {} at {} m, noise {}, filter {}", nameOf(row.law), row.scene, row.distance_m,
                     nameOf(row.noise), row.filtered ? "on" : "off");
}

bool isMeasured(const AccuracyRow& row) {
  return row.pops.pushes > 0;
}

Requirement noPopThrough(const std::vector<AccuracyRow>& rows, ForceLaw law) {
  Requirement requirement{fmt::format("{}: no pop-through up to 20 N", nameOf(law)), 0, {}};
  for (const AccuracyRow& row : rows) {
    if (row.law != law || !isMeasured(row)) continue;
    ++requirement.rows;
    if (row.pops.popped_under.back() == 0) continue;
    requirement.violations.push_back(
        fmt::format("{}: {} of {} pushes, the first at {:.2f} N{}", placeOf(row),
                    row.pops.popped_under.back(), row.pops.pushes, row.pops.least_force_n,
                    row.pops.around > 0 ? fmt::format(", {} around the border", row.pops.around) : ""));
  }
  return requirement;
}

Requirement closedFormPopThrough(const std::vector<AccuracyRow>& rows) {
  constexpr double kWithin = 0.03;
  const rt::SpringParameters springs;
  Requirement requirement{
      "nearest_springs: pop-through force on the noise-free plane within 3 % of the closed form", 0, {}};
  for (const AccuracyRow& row : rows) {
    const bool applies = row.law == ForceLaw::nearest_springs && row.scene == "plane" &&
                         row.noise == SceneNoise::none && isMeasured(row);
    if (!applies) continue;
    ++requirement.rows;
    const double expected_n =
        popThroughForce_n(springs, nearestDiscRadius_m({}, row.distance_m, springs.max_points));
    const double difference = row.pops.least_force_n / expected_n - 1;
    if (std::abs(difference) <= kWithin) continue;
    requirement.violations.push_back(fmt::format("{}: {:.2f} N for {:.2f} N ({:+.1f} %)", placeOf(row),
                                                 row.pops.least_force_n, expected_n, 100 * difference));
  }
  return requirement;
}

Requirement surfaceWithNoise(const std::vector<AccuracyRow>& rows) {
  constexpr double kFarthest_m = 1.2;
  Requirement requirement{"surface, real noise, planes to 1.2 m: RMS below one JND", 0, {}};
  for (const AccuracyRow& row : rows) {
    const bool real_noise = row.noise == SceneNoise::sensor || row.noise == SceneNoise::harsh;
    const bool applies = row.law == ForceLaw::surface && real_noise && row.distance_m <= kFarthest_m &&
                         row.scene.starts_with("plane");
    if (!applies) continue;
    ++requirement.rows;
    const ForceErrors& errors = row.against_surface;
    if (errors.error_jnd.rms() < 1) continue;
    requirement.violations.push_back(fmt::format("{}: {:.2f} JND RMS, direction {:.2f} deg RMS, {:.2f} max",
                                                 placeOf(row), errors.error_jnd.rms(),
                                                 errors.direction_deg.rms(), errors.direction_deg.max()));
  }
  return requirement;
}

Requirement surfaceWithoutNoise(const std::vector<AccuracyRow>& rows) {
  Requirement requirement{"surface, no noise, planes: below 1 % and 1 degree", 0, {}};
  for (const AccuracyRow& row : rows) {
    const bool applies =
        row.law == ForceLaw::surface && row.noise == SceneNoise::none && row.scene.starts_with("plane");
    if (!applies) continue;
    ++requirement.rows;
    const ForceErrors& errors = row.against_surface;
    if (errors.error_percent.max() < 1 && errors.direction_deg.max() < 1) continue;
    requirement.violations.push_back(fmt::format("{}: up to {:.2f} % and {:.2f} deg", placeOf(row),
                                                 errors.error_percent.max(), errors.direction_deg.max()));
  }
  return requirement;
}

Requirement sameOnEveryGrid(const std::vector<AccuracyRow>& rows) {
  // forces below 25 N summed over a few thousand points in double precision, in another order
  constexpr double kRounding_n = 1e-9;
  Requirement requirement{"laws on points: the same force on every grid", 0, {}};
  for (const AccuracyRow& row : rows) {
    if (row.grid_difference_n < 0) continue;
    ++requirement.rows;
    if (row.grid_difference_n < kRounding_n) continue;
    requirement.violations.push_back(fmt::format("{}, voxels of {:.0f} mm: {:.1e} N", placeOf(row),
                                                 1000 * row.voxel_edge_m, row.grid_difference_n));
  }
  return requirement;
}

}  // namespace

std::vector<AccuracySummary> summaryOf(const std::vector<AccuracyRow>& rows) {
  std::vector<AccuracySummary> summaries;
  for (const AccuracyRow& row : rows) {
    if (!isMeasured(row)) continue;
    const auto same = [&row](const AccuracySummary& other) {
      return other.law == row.law && other.noise == row.noise && other.filtered == row.filtered;
    };
    auto place = std::find_if(summaries.begin(), summaries.end(), same);
    if (place == summaries.end()) {
      AccuracySummary summary;
      summary.law = row.law;
      summary.noise = row.noise;
      summary.filtered = row.filtered;
      summaries.push_back(summary);
      place = summaries.end() - 1;
    }
    place->against_surface.add(row.against_surface);
    place->against_law.add(row.against_law);
    place->proxy_to_surface_mm.add(row.proxy_to_surface_mm);
    place->pops.add(row.pops);
    place->largest_drop_n = std::max(place->largest_drop_n, row.largest_drop_n);
    place->law_step_n = std::max(place->law_step_n, row.law_step_n);
    place->blended_step_n = std::max(place->blended_step_n, row.blended_step_n);
    place->slew_n_per_s = std::max(place->slew_n_per_s, row.slew_n_per_s);
    place->outside_model += row.outside_model;
  }
  std::stable_sort(summaries.begin(), summaries.end(),
                   [](const AccuracySummary& a, const AccuracySummary& b) { return a.law < b.law; });
  return summaries;
}

std::vector<Requirement> requirementsOf(const std::vector<AccuracyRow>& rows) {
  return {noPopThrough(rows, ForceLaw::proxy), noPopThrough(rows, ForceLaw::surface),
          closedFormPopThrough(rows),          surfaceWithNoise(rows),
          surfaceWithoutNoise(rows),           sameOnEveryGrid(rows)};
}

}  // namespace hapticd::tools
