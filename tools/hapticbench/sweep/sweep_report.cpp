// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/sweep/sweep_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "config/law_choice.h"
#include "tools/hapticbench/table.h"

namespace hapticd::tools {
namespace {

Json figureWhere(bool has, auto figure) {
  return has ? Json(figure) : noFigure();
}

const std::vector<Column<SweepResult>>& columns() {
  using Row = SweepResult;
  static const std::vector<Column<Row>> all{
      {"/index", "", 0, [](const Row& r) { return r.point.index; }},
      {"/law", "law", 0, [](const Row& r) { return config::nameOf(r.point.law); }},
      {"", "set", 0, [](const Row& r) { return r.point.isPapers() ? "the paper's" : ""; }},
      {"/stiffness_n_per_m", "k_s N/m", 0, [](const Row& r) { return r.point.springs.stiffness_n_per_m; }},
      {"/radius_m", "D mm", 0,
       [](const Row& r) { return figureWhere(r.point.usesRadius(), r.point.springs.radius_m); }, 1e3},
      {"/max_points", "N_max", 0,
       [](const Row& r) { return figureWhere(r.point.usesMaxPoints(), r.point.springs.max_points); }},
      {"/felt_stiffness_n_per_m", "rendered N/m", 0,
       [](const Row& r) { return r.feel.rendered_stiffness_n_per_m; }},
      {"/steepest_stiffness_n_per_m", "steepest N/m", 0,
       [](const Row& r) { return r.feel.steepest_stiffness_n_per_m; }},
      {"/pop_through_n", "pops at N", 2, [](const Row& r) { return r.feel.pop_through_n; }},
      {"/edge_radius_m", "", 0, [](const Row& r) { return r.feel.edge_radius_m; }},
      {"/edge_is_outside", "", 0, [](const Row& r) { return r.feel.edge_is_outside; }},
      {"", "edge mm", 1,
       [](const Row& r) { return (r.feel.edge_is_outside ? 1e3 : -1e3) * r.feel.edge_radius_m; }},
      {"/smallest_ridge_m", "ridge mm", 2, [](const Row& r) { return r.feel.smallest_ridge_m; }, 1e3},
      {"/stroke_h_m", "", 0, [](const Row& r) { return r.feel.stroke_h_m; }},
      {"/noise_median_n", "noise N", 3, [](const Row& r) { return r.noise.median_n; }},
      {"/noise_largest_n", "largest N", 3, [](const Row& r) { return r.noise.largest_n; }},
      {"/noise_sites", "", 0, [](const Row& r) { return r.noise.sites; }},
      {"/noise_nearest_m", "", 0, [](const Row& r) { return r.noise.nearest_m; }},
      {"/noise_farthest_m", "", 0, [](const Row& r) { return r.noise.farthest_m; }},
      {"/pops_through", "", 0, [](const Row& r) { return r.feel.pop_through_n < kNoPopThrough_n; }},
      {"", "margin", 2, [](const Row& r) { return r.stability_margin; }},
      {"/stability_margin", "", 0,  // JSON has no infinity
       [](const Row& r) { return figureWhere(std::isfinite(r.stability_margin), r.stability_margin); }},
      {"/median_force_us", "us", 2, [](const Row& r) {
         return figureWhere(r.feel.median_force_us.has_value(), r.feel.median_force_us.value_or(0));
       }}};
  return all;
}

}  // namespace

std::string sweepText(const SweepSettings& settings, const std::vector<SweepResult>& results) {
  const ForceNoise noise = results.empty() ? ForceNoise{} : results.front().noise;
  const std::string text = fmt::format(
      "Known surfaces 1 m away; noise: {}. rendered, steepest: -dF/dh from 5 to 15 mm penetration, or from\n"
      "the onset of a spring law to its peak, mean and over 1 mm. pops at: force at which the surface\n"
      "gives way, {:g}: not below that. edge: where the force is half of the plane's, mm beyond (+) or\n"
      "before (-) the end of a half-plane. ridge: height of the lowest ridge of 20 mm width that changes\n"
      "the force by one JND (7 %, 0.1 N at least), 0: none of those tried. noise: standard deviation of\n"
      "the force from frame to frame, median and largest of {} still places {:.2f} to {:.2f} m away,\n"
      "depth filter {}. margin: largest stable stiffness of a 45 g device in a light hand at {} ms delay\n"
      "by the steepest.\n\n",
      settings.noise_source, kNoPopThrough_n, noise.sites, noise.nearest_m, noise.farthest_m,
      settings.filter ? "on" : "off", settings.delay_ticks);
  std::vector<SweepResult> sorted = results;
  std::ranges::stable_sort(sorted, {}, [](const SweepResult& result) { return result.point.law; });
  return text + tableText(columns(), sorted);
}

std::string sweepJson(const SweepSettings& settings, const std::vector<SweepResult>& results) {
  const Json document{{"benchmark", "sweep"},
                      {"quick", settings.quick},
                      {"filter", settings.filter},
                      {"delay_ticks", settings.delay_ticks},
                      {"noise_source", settings.noise_source},
                      {"noise_digest", settings.noise_digest},
                      {"points", tableJson(columns(), results)}};
  return document.dump(1) + "\n";
}

}  // namespace hapticd::tools
