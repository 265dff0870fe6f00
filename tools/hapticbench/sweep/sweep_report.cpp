// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/sweep/sweep_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "config/law_choice.h"
#include "tools/hapticbench/table.h"

namespace hapticd::tools {
namespace {

const std::vector<Column<SweepResult>>& columns() {
  using Row = SweepResult;
  static const std::vector<Column<Row>> all{
      {"", "law", 0, [](const Row& r) { return config::nameOf(r.point.law); }},
      {"", "set", 0, [](const Row& r) { return r.point.isPapers() ? "the paper's" : ""; }},
      {"", "k_s N/m", 0, [](const Row& r) { return r.point.springs.stiffness_n_per_m; }},
      {"", "D mm", 0,
       [](const Row& r) { return r.point.usesRadius() ? Json(1e3 * r.point.springs.radius_m) : Json(); }},
      {"", "N_max", 0,
       [](const Row& r) { return r.point.usesMaxPoints() ? Json(r.point.springs.max_points) : Json(); }},
      {"", "rendered N/m", 0, [](const Row& r) { return r.feel.rendered_stiffness_n_per_m; }},
      {"", "steepest N/m", 0, [](const Row& r) { return r.feel.steepest_stiffness_n_per_m; }},
      {"", "pops at N", 2, [](const Row& r) { return r.feel.pop_through_n; }},
      {"", "edge mm", 1,
       [](const Row& r) { return (r.feel.edge_is_outside ? 1e3 : -1e3) * r.feel.edge_radius_m; }},
      {"", "ridge mm", 2, [](const Row& r) { return 1e3 * r.feel.smallest_ridge_m; }},
      {"", "noise N", 3, [](const Row& r) { return r.noise.median_n; }},
      {"", "largest N", 3, [](const Row& r) { return r.noise.largest_n; }},
      {"", "margin", 2, [](const Row& r) { return r.stability_margin; }},
      {"", "us", 2, [](const Row& r) { return r.feel.median_force_us; }}};
  return all;
}

}  // namespace

std::string sweepText(const SweepPart& part) {
  const ForceNoise noise = part.results.empty() ? ForceNoise{} : part.results.front().noise;
  const std::string text = fmt::format(
      "Known surfaces 1 m away; noise: {}. rendered, steepest: -dF/dh from 5 to 15 mm penetration, or from\n"
      "the onset of a spring law to its peak, mean and over 1 mm. pops at: force at which the surface\n"
      "gives way, {:g}: not below that. edge: where the force is half of the plane's, mm beyond (+) or\n"
      "before (-) the end of a half-plane. ridge: height of the lowest ridge of 20 mm width that changes\n"
      "the force by one JND (7 %, 0.1 N at least), 0: none of those tried. noise: standard deviation of\n"
      "the force from frame to frame, median and largest of {} still places {:.2f} to {:.2f} m away,\n"
      "depth filter {}. margin: largest stable stiffness of a 45 g device in a light hand at {} ms delay\n"
      "by the steepest.\n\n",
      part.settings.noise_source, kNoPopThrough_n, noise.sites, noise.nearest_m, noise.farthest_m,
      part.settings.filter ? "on" : "off", part.settings.delay_ticks);
  std::vector<SweepResult> sorted = part.results;
  std::ranges::stable_sort(sorted, {}, [](const SweepResult& result) { return result.point.law; });
  return text + tableText(columns(), sorted);
}

}  // namespace hapticd::tools
