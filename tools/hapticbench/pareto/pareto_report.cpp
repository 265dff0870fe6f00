// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/pareto/pareto_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <iterator>
#include <nlohmann/json.hpp>

namespace hapticd::tools {
namespace {

using Json = nlohmann::ordered_json;

template <typename... Arguments>
void add(fmt::memory_buffer& text, fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  fmt::format_to(std::back_inserter(text), format, std::forward<Arguments>(arguments)...);
}

std::string differenceOf(const ParetoPoint& point) {
  return point.run.largest_difference_n < 0 ? "" : fmt::format("{:.1e}", point.run.largest_difference_n);
}

void addPoints(fmt::memory_buffer& text, const ParetoResult& result) {
  add(text, "\n{:<32}{:>10}{:>10}{:>10}{:>12}{:>12}{:>12}{:>10}{:>9}{:>10}\n", "law and setting", "force us",
      "p99.9 us", "max us", "model us", "max us", "CPU ms/s", "RMS JND", "RMS mm", "differ N");
  for (const ParetoPoint& point : result.points) {
    const CpuCost& cost = point.cost;
    add(text, "{:<32}{:>10.2f}{:>10.2f}{:>10.2f}{:>12.1f}{:>12.1f}{:>12.2f}{:>10.2f}{:>9.2f}{:>10}\n",
        point.run.kind.name, cost.force_median_us, cost.force_p999_us, cost.force_max_us,
        cost.model_median_us, cost.model_max_us, cost.cpu_ms_per_s(), point.error.error_jnd.rms(),
        point.error_mm(), differenceOf(point));
  }
}

void addLaws(fmt::memory_buffer& text, const ParetoResult& result) {
  if (result.laws.empty()) return;
  add(text, "\n{:<32}{:>10}{:>12}{:>10}{:>10}{:>9}\n", "plane turned by 30 degrees", "at m", "model us",
      "force us", "CPU ms/s", "RMS mm");
  for (const LawAtDistance& row : result.laws) {
    add(text, "{:<32}{:>10.1f}{:>12.1f}{:>10.2f}{:>10.2f}{:>9.2f}\n", nameOf(row.setting), row.distance_m,
        row.cost.model_median_us, row.cost.force_median_us, row.cost.cpu_ms_per_s(), 1000 * row.error_m);
  }
}

void addDistanceErrors(fmt::memory_buffer& text, const ParetoResult& result) {
  if (result.distance_errors.empty()) return;
  add(text, "\n{:<32}{:>10}{:>10}{:>10}{:>10}{:>12}{:>9}\n", "strokes 8 mm deep", "noise", "surface", "at m",
      "RMS JND", "times floor", "lost %");
  for (const DistanceError& row : result.distance_errors) {
    add(text, "{:<32}{:>10}{:>10}{:>10.1f}{:>10.2f}{:>12}{:>9.1f}\n", row.law, nameOf(row.noise),
        nameOf(row.kind), row.distance_m, row.rms_jnd,
        row.by_floor ? fmt::format("{:.2f}", *row.by_floor) : "", row.lost_percent);
  }
}

void addEvaluations(fmt::memory_buffer& text, const ParetoResult& result) {
  if (result.evaluations.empty()) return;
  add(text, "\n{:<32}{:>14}{:>12}{:>18}{:>9}{:>12}{:>9}\n", "one force, medians", "motion", "nanoflann us",
      "nearest_springs us", "times", "surface us", "times");
  for (const EvaluationRow& row : result.evaluations) {
    add(text, "{:<32}{:>14}{:>12.2f}{:>18.3f}{:>9.1f}{:>12.3f}{:>9.1f}\n", row.scene,
        row.along_path ? "up to 1 m/s" : "unrelated", row.nanoflann_us, row.nearest_springs_us,
        row.nanoflann_us / row.nearest_springs_us, row.surface_us, row.nanoflann_us / row.surface_us);
  }
}

void addHardFrames(fmt::memory_buffer& text, const ParetoResult& result) {
  if (result.hard_frames.empty()) return;
  add(text, "\n{:<20}{:<32}{:>14}{:>12}{:>14}\n", "hard frame", "law", "force max us", "% of tick",
      "model max us");
  for (const HardFrameRow& row : result.hard_frames) {
    add(text, "{:<20}{:<32}{:>14.1f}{:>12.2f}{:>14.0f}\n", row.frame, row.law, row.force_max_us,
        row.force_max_us / 10, row.model_max_us);
  }
}

Json jsonOf(const ParetoPoint& point) {
  const CpuCost& cost = point.cost;
  Json json{{"name", point.run.kind.name}, {"library", !point.run.kind.is_ours}};
  if (point.run.kind.is_ours) {
    const LawSetting& setting = point.run.kind.setting;
    json["law"] = nameOf(setting.law);
    json["filtered"] = setting.filtered;
    json["fusion_frames"] = setting.fusion_frames;
  }
  json["force_us"] = {{"count", point.run.samples.force_ns.size()},
                      {"median", cost.force_median_us},
                      {"mean", cost.force_mean_us},
                      {"p99_9", cost.force_p999_us},
                      {"max", cost.force_max_us}};
  json["model_us"] = {{"count", point.run.samples.model_ns.size()},
                      {"median", cost.model_median_us},
                      {"mean", cost.model_mean_us},
                      {"max", cost.model_max_us}};
  json["models"] = point.run.models;
  json["ticks_with_force"] = point.run.contacts;
  json["cpu_ms_per_s"] = cost.cpu_ms_per_s();
  json["rms_error_jnd"] = point.error.error_jnd.rms();
  json["rms_error_mm"] = point.error_mm();
  json["rms_error_n"] = point.error.error_n.rms();
  if (point.run.largest_difference_n >= 0) json["largest_difference_n"] = point.run.largest_difference_n;
  return json;
}

Json jsonOf(const LawAtDistance& row) {
  return {{"law", nameOf(row.setting.law)},
          {"filtered", row.setting.filtered},
          {"distance_m", row.distance_m},
          {"rms_error_mm", 1000 * row.error_m},
          {"model_median_us", row.cost.model_median_us},
          {"force_median_us", row.cost.force_median_us},
          {"cpu_ms_per_s", row.cost.cpu_ms_per_s()}};
}

Json jsonOf(const DistanceError& row) {
  return {{"law", row.law},
          {"noise", nameOf(row.noise)},
          {"surface", nameOf(row.kind)},
          {"distance_m", row.distance_m},
          {"rms_error_jnd", row.rms_jnd},
          {"error_by_floor", row.by_floor ? Json(*row.by_floor) : Json()},
          {"lost_percent", row.lost_percent}};
}

Json jsonOf(const SensorLimit& limit) {
  return {{"noise", nameOf(limit.noise)},
          {"distance_m", limit.distance_m},
          {"raw_unit_mm", limit.raw_unit_mm},
          {"narrowest_mm", limit.narrowest_mm},
          {"flat_40_mm_jnd", limit.flat_40_mm_jnd},
          {"flat_160_mm_jnd", limit.flat_160_mm_jnd},
          {"curved_40_mm_jnd", limit.curved_40_mm_jnd}};
}

}  // namespace

std::string paretoTable(const ParetoResult& result, int cpu) {
  fmt::memory_buffer text;
  add(text,
      "CPU time on one core{}, HIP at up to 0.5 m/s that touches and leaves the surface, on {}.\n"
      "Times: the fastest of several runs, sample by sample, less the clock's own. CPU: 30 frames modelled "
      "and 1000\n"
      "forces. JND: RMS error against the true surface at 1 m, over max(7 % of F, 0.1 N); mm: the same in N "
      "over k_s; plane, sphere and a plane\n"
      "turned by 30 degrees, with the harsher noise. differ: from the paper's law in double precision.\n",
      cpu < 0 ? ", not pinned" : fmt::format(", CPU {}", cpu), fmt::join(result.scenes, ", "));
  addPoints(text, result);
  addLaws(text, result);
  addDistanceErrors(text, result);
  addEvaluations(text, result);
  addHardFrames(text, result);
  add(text, "\nwhat must hold\n");
  for (const ParetoRequirement& requirement : requirementsOf(result)) {
    add(text, "  {:<5}{}: {:.3g} ({} {:g})\n", requirement.kept() ? "yes" : "NO", requirement.text,
        requirement.measured, requirement.at_least ? "at least" : "at most", requirement.limit);
  }
  return fmt::to_string(text);
}

std::string paretoJson(const ParetoResult& result, int cpu) {
  Json document{{"benchmark", "pareto"}, {"cpu", cpu}, {"scenes", result.scenes}};
  for (const char* list :
       {"points", "laws", "distances", "sensor", "evaluations", "hard_frames", "requirements"})
    document[list] = Json::array();
  for (const ParetoPoint& point : result.points) document["points"].push_back(jsonOf(point));
  for (const LawAtDistance& row : result.laws) document["laws"].push_back(jsonOf(row));
  for (const DistanceError& row : result.distance_errors) document["distances"].push_back(jsonOf(row));
  for (const SensorLimit& row : result.sensor_limits) document["sensor"].push_back(jsonOf(row));
  for (const EvaluationRow& row : result.evaluations) {
    document["evaluations"].push_back({{"scene", row.scene},
                                       {"along_path", row.along_path},
                                       {"nanoflann_us", row.nanoflann_us},
                                       {"nearest_springs_us", row.nearest_springs_us},
                                       {"surface_us", row.surface_us}});
  }
  for (const HardFrameRow& row : result.hard_frames) {
    document["hard_frames"].push_back({{"frame", row.frame},
                                       {"law", row.law},
                                       {"force_max_us", row.force_max_us},
                                       {"model_max_us", row.model_max_us}});
  }
  for (const ParetoRequirement& requirement : requirementsOf(result)) {
    document["requirements"].push_back({{"text", requirement.text},
                                        {"measured", requirement.measured},
                                        {requirement.at_least ? "at_least" : "at_most", requirement.limit},
                                        {"kept", requirement.kept()}});
  }
  return document.dump(2) + "\n";
}

}  // namespace hapticd::tools
