// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/pareto/pareto_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace hapticd::tools {
namespace {

/// Returns the figure for one of our own laws, otherwise null.
Json ifOurs(const ParetoPoint& point, Json figure) {
  return point.run.kind.is_ours ? std::move(figure) : noFigure();
}

Json ifCompared(const ParetoPoint& point, Json figure) {
  return point.run.largest_difference_n >= 0 ? std::move(figure) : noFigure();
}

const std::vector<Column<ParetoPoint>>& pointColumns() {
  using P = ParetoPoint;
  static const std::vector<Column<P>> all{
      {"/name", "law and setting", 0, [](const P& p) { return p.run.kind.name; }},
      {"/library", "", 0, [](const P& p) { return !p.run.kind.is_ours; }},
      {"/law", "", 0, [](const P& p) { return ifOurs(p, nameOf(p.run.kind.setting.law)); }},
      {"/filtered", "", 0, [](const P& p) { return ifOurs(p, p.run.kind.setting.filtered); }},
      {"/fusion_frames", "", 0, [](const P& p) { return ifOurs(p, p.run.kind.setting.fusion_frames); }},
      {"/force_us/count", "", 0, [](const P& p) { return p.run.samples.force_ns.size(); }},
      {"/force_us/median", "force us", 2, [](const P& p) { return p.cost.force_median_us; }},
      {"/force_us/mean", "", 0, [](const P& p) { return p.cost.force_mean_us; }},
      {"/force_us/p99_9", "p99.9 us", 2, [](const P& p) { return p.cost.force_p999_us; }},
      {"/force_us/max", "max us", 2, [](const P& p) { return p.cost.force_max_us; }},
      {"/model_us/count", "", 0, [](const P& p) { return p.run.samples.model_ns.size(); }},
      {"/model_us/median", "model us", 1, [](const P& p) { return p.cost.model_median_us; }},
      {"/model_us/mean", "", 0, [](const P& p) { return p.cost.model_mean_us; }},
      {"/model_us/max", "max us", 1, [](const P& p) { return p.cost.model_max_us; }},
      {"/models", "", 0, [](const P& p) { return p.run.models; }},
      {"/ticks_with_force", "", 0, [](const P& p) { return p.run.contacts; }},
      {"/cpu_ms_per_s", "CPU ms/s", 2, [](const P& p) { return p.cost.cpu_ms_per_s(); }},
      {"/rms_error_jnd", "RMS JND", 2, [](const P& p) { return p.error.error_jnd.rms(); }},
      {"/rms_error_mm", "RMS mm", 2, [](const P& p) { return p.error_mm(); }},
      {"/rms_error_n", "", 0, [](const P& p) { return p.error.error_n.rms(); }},
      {"/largest_difference_n", "", 0, [](const P& p) { return ifCompared(p, p.run.largest_difference_n); }},
      {"", "differs N", 0,
       [](const P& p) { return ifCompared(p, fmt::format("{:.1e}", p.run.largest_difference_n)); }}};
  return all;
}

const std::vector<Column<LawAtDistance>>& lawColumns() {
  using Row = LawAtDistance;
  static const std::vector<Column<Row>> all{
      {"", "plane turned by 30 degrees", 0, [](const Row& r) { return nameOf(r.setting); }},
      {"/law", "", 0, [](const Row& r) { return nameOf(r.setting.law); }},
      {"/filtered", "", 0, [](const Row& r) { return r.setting.filtered; }},
      {"/distance_m", "at m", 1, &Row::distance_m},
      {"/rms_error_mm", "RMS mm", 2, [](const Row& r) { return 1000 * r.error_m; }},
      {"/model_median_us", "model us", 1, [](const Row& r) { return r.cost.model_median_us; }},
      {"/force_median_us", "force us", 2, [](const Row& r) { return r.cost.force_median_us; }},
      {"/cpu_ms_per_s", "CPU ms/s", 2, [](const Row& r) { return r.cost.cpu_ms_per_s(); }}};
  return all;
}

const std::vector<Column<DistanceError>>& distanceColumns() {
  using Row = DistanceError;
  static const std::vector<Column<Row>> all{
      {"/law", "strokes 8 mm deep", 0, &Row::law},
      {"/noise", "noise", 0, [](const Row& r) { return nameOf(r.noise); }},
      {"/surface", "surface", 0, [](const Row& r) { return nameOf(r.kind); }},
      {"/distance_m", "at m", 1, &Row::distance_m},
      {"/rms_error_jnd", "RMS JND", 2, &Row::rms_jnd},
      {"/error_by_floor", "times floor", 2,
       [](const Row& r) { return r.by_floor ? Json(*r.by_floor) : Json(); }},
      {"/lost_percent", "lost %", 1, &Row::lost_percent}};
  return all;
}

const std::vector<Column<SensorLimit>>& sensorColumns() {
  using Row = SensorLimit;
  static const std::vector<Column<Row>> all{
      {"/noise", "the sensor", 0, [](const Row& r) { return nameOf(r.noise); }},
      {"/distance_m", "at m", 1, &Row::distance_m},
      {"/raw_unit_mm", "unit mm", 1, &Row::raw_unit_mm},
      {"/narrowest_mm", "narrowest mm", 0, &Row::narrowest_mm},
      {"/flat_40_mm_jnd", "flat 40 mm JND", 2, &Row::flat_40_mm_jnd},
      {"/flat_160_mm_jnd", "flat 160 mm JND", 2, &Row::flat_160_mm_jnd},
      {"/curved_40_mm_jnd", "curved 40 mm JND", 2, &Row::curved_40_mm_jnd}};
  return all;
}

const std::vector<Column<EvaluationRow>>& evaluationColumns() {
  using Row = EvaluationRow;
  static const std::vector<Column<Row>> all{
      {"/scene", "one force, medians", 0, &Row::scene},
      {"/along_path", "along a path", 0, &Row::along_path},
      {"/nanoflann_us", "nanoflann us", 2, &Row::nanoflann_us},
      {"/nearest_springs_us", "nearest_springs us", 3, &Row::nearest_springs_us},
      {"", "times", 1, [](const Row& r) { return r.nanoflann_us / r.nearest_springs_us; }},
      {"/surface_us", "surface us", 3, &Row::surface_us},
      {"", "times", 1, [](const Row& r) { return r.nanoflann_us / r.surface_us; }}};
  return all;
}

const std::vector<Column<HardFrameRow>>& hardFrameColumns() {
  using Row = HardFrameRow;
  static const std::vector<Column<Row>> all{
      {"/frame", "hard frame", 0, &Row::frame},
      {"/law", "law", 0, &Row::law},
      {"/force_max_us", "force max us", 1, &Row::force_max_us},
      {"", "% of tick", 2, [](const Row& r) { return r.force_max_us / 10; }},
      {"/model_max_us", "model max us", 0, &Row::model_max_us}};
  return all;
}

}  // namespace

std::string paretoText(const ParetoResult& result, int cpu) {
  std::string text = fmt::format(
      "CPU time on one core{}, HIP at up to 0.5 m/s that touches and leaves the surface, on {}. Times:\n"
      "the fastest of several runs, sample by sample, less the cost of the clock. CPU: 30 frames modelled\n"
      "and 1000 forces. JND: RMS error against the true surface at 1 m, over max(7 % of F, 0.1 N); mm:\n"
      "the same in N over k_s; plane, sphere and a plane turned by 30 degrees, with the harsher noise.\n"
      "differs: from the paper's law in double precision.\n",
      cpu < 0 ? ", not pinned" : fmt::format(", CPU {}", cpu), fmt::join(result.scenes, ", "));
  for (const std::string& table :
       {tableText(pointColumns(), result.points), tableText(lawColumns(), result.laws),
        tableText(distanceColumns(), result.distance_errors),
        tableText(sensorColumns(), result.sensor_limits), tableText(evaluationColumns(), result.evaluations),
        tableText(hardFrameColumns(), result.hard_frames)}) {
    if (!table.empty()) text += "\n" + table;
  }
  return text + requirementsText(requirementsOf(result));
}

std::string paretoJson(const ParetoResult& result, int cpu) {
  const Json document{{"benchmark", "pareto"},
                      {"cpu", cpu},
                      {"scenes", result.scenes},
                      {"points", tableJson(pointColumns(), result.points)},
                      {"laws", tableJson(lawColumns(), result.laws)},
                      {"distances", tableJson(distanceColumns(), result.distance_errors)},
                      {"sensor", tableJson(sensorColumns(), result.sensor_limits)},
                      {"evaluations", tableJson(evaluationColumns(), result.evaluations)},
                      {"hard_frames", tableJson(hardFrameColumns(), result.hard_frames)},
                      {"requirements", requirementsJson(requirementsOf(result))}};
  return document.dump(2) + "\n";
}

}  // namespace hapticd::tools
