// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/pareto/pareto_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace hapticd::tools {
namespace {

/// Appends `value` unless the list contains it.
template <typename Value>
void addOnce(std::vector<Value>& values, const Value& value) {
  if (std::ranges::find(values, value) == values.end()) values.push_back(value);
}

/// The name of a noise model in the tables.
const char* cameraOf(SceneNoise noise) {
  return noise == SceneNoise::harsh ? "harsher" : "quieter";
}

/// Two significant digits: the repeatability of the measurement allows no more.
std::string twoDigits(double value) {
  if (!std::isfinite(value)) return "-";
  if (value < 0.005) return "0";
  return value < 10 ? fmt::format("{:#.2g}", value) : fmt::format("{:.0f}", value);
}

/// Returns `first` and a heading for each distance.
std::vector<std::string> headingsOf(std::vector<std::string> first, const std::vector<double>& distances_m) {
  for (const double distance_m : distances_m) first.push_back(fmt::format("{:g} m", distance_m));
  return first;
}

/// The figures of one law, noise and distance for each kind of surface: "0.2 / 0.4 / 0.3".
template <typename Figure>
std::string cellOf(const ParetoResult& result, const std::string& law, SceneNoise noise, double distance_m,
                   Figure figure) {
  std::string cell;
  for (const DistanceError& row : result.distance_errors) {
    if (row.law != law || row.noise != noise || row.distance_m != distance_m) continue;
    cell += (cell.empty() ? "" : " / ") + figure(row);
  }
  return cell;
}

/// A row for each law and noise. `figure` makes a text of a DistanceError.
template <typename Figure>
std::string errorsTable(const ParetoResult& result, const std::string& heading, bool with_springs,
                        Figure figure) {
  std::vector<std::string> laws;
  std::vector<SceneNoise> noises;
  std::vector<double> distances_m;
  for (const DistanceError& row : result.distance_errors) {
    if (with_springs || !row.law.ends_with("springs")) addOnce(laws, row.law);
    addOnce(noises, row.noise);
    addOnce(distances_m, row.distance_m);
  }
  std::vector<std::vector<std::string>> rows;
  for (const std::string& law : laws) {
    for (const SceneNoise noise : noises) {
      auto& cells = rows.emplace_back(std::vector<std::string>{"`" + law + "`", cameraOf(noise)});
      for (const double distance_m : distances_m)
        cells.push_back(cellOf(result, law, noise, distance_m, figure));
    }
  }
  return markdownTable(headingsOf({heading, "camera"}, distances_m), 2, rows) + "\n";
}

std::string errorsMarkdown(const ParetoResult& result) {
  const auto& errors = result.distance_errors;
  if (errors.empty()) return "";
  std::string text =
      "RMS error of the force in JND on strokes 8 mm deep (4 N; 1 JND = 0.28 N is just noticed), on flat / "
      "curved / moving surfaces: planes to 30 degrees, a ball of 100 mm and a rod of 80 mm, a plane at "
      "0.3 m/s.\n\n" +
      errorsTable(result, "law", true, [](const DistanceError& row) { return twoDigits(row.rms_jnd); });
  if (std::ranges::all_of(errors, [](const DistanceError& row) { return row.law.ends_with("springs"); }))
    return text;
  text +=
      "The same over the least that the sensor's noise allows with 40 mm of surface (8 frames, 3 where it "
      "moves); below 1 a flat surface is larger than that:\n\n" +
      errorsTable(result, "times the floor", false,
                  [](const DistanceError& row) { return row.by_floor ? twoDigits(*row.by_floor) : "-"; });
  return text + "Contact lost, % of the stroke:\n\n" +
         errorsTable(result, "contact lost", false,
                     [](const DistanceError& row) { return twoDigits(row.lost_percent); });
}

/// The range over the noise models, "0.14 to 0.16"; "-" where nothing was measured.
std::string rangeOf(const ParetoResult& result, SurfaceKind kind, double distance_m) {
  std::vector<double> errors_jnd;
  for (const DistanceError& row : result.distance_errors) {
    if (row.law == "surface" && row.kind == kind && row.distance_m == distance_m)
      errors_jnd.push_back(row.rms_jnd);
  }
  if (errors_jnd.empty()) return "-";
  const auto [smallest, largest] = std::ranges::minmax(errors_jnd);
  const std::string from = twoDigits(smallest), to = twoDigits(largest);
  return from == to ? from : fmt::format("{} to {}", from, to);
}

std::string sensorMarkdown(const ParetoResult& result) {
  if (result.sensor_limits.empty()) return "";
  std::vector<SceneNoise> noises;
  std::vector<double> distances_m;
  for (const SensorLimit& limit : result.sensor_limits) {
    addOnce(noises, limit.noise);
    addOnce(distances_m, limit.distance_m);
  }
  std::vector<std::vector<std::string>> rows;
  const auto add = [&](const char* what, const char* camera, SceneNoise noise, double SensorLimit::*figure) {
    auto& cells = rows.emplace_back(std::vector<std::string>{what, camera});
    for (const SensorLimit& limit : result.sensor_limits) {
      if (limit.noise == noise) cells.push_back(twoDigits(limit.*figure));
    }
  };
  add("one step of depth, mm", "all", noises.front(), &SensorLimit::raw_unit_mm);
  add("narrowest body, mm", "all", noises.front(), &SensorLimit::narrowest_mm);
  for (const SceneNoise noise : noises) {
    add("flat, 40 mm", cameraOf(noise), noise, &SensorLimit::flat_40_mm_jnd);
    add("flat, 160 mm", cameraOf(noise), noise, &SensorLimit::flat_160_mm_jnd);
    add("curved, 40 mm", cameraOf(noise), noise, &SensorLimit::curved_40_mm_jnd);
  }
  return "What no law can do better, because of the sensor: the step of its depth, bodies of fewer than "
         "eight pixels, and the least error (JND) on a patch of that side, still, 8 frames.\n\n" +
         markdownTable(headingsOf({"the sensor", "camera"}, distances_m), 2, rows) + "\n";
}

std::string costsMarkdown(const ParetoResult& result) {
  std::vector<double> distances_m;
  for (const LawAtDistance& row : result.laws) {
    if (std::ranges::find(kCostDistances_m, row.distance_m) != std::end(kCostDistances_m))
      addOnce(distances_m, row.distance_m);
  }
  if (distances_m.empty()) return "";
  std::vector<std::vector<std::string>> rows;
  for (const LawSetting& setting : shippedSettings()) {
    auto& cells = rows.emplace_back(std::vector<std::string>{nameOf(setting)});
    for (const LawAtDistance& row : result.laws) {
      if (row.setting != setting || std::ranges::find(distances_m, row.distance_m) == distances_m.end())
        continue;
      cells.push_back(fmt::format("{:.0f} / {:.2f} / {:.2f}", row.cost.model_median_us,
                                  row.cost.force_median_us, row.cost.cpu_ms_per_s()));
    }
  }
  return "Cost on a plane turned by 30 degrees: median of a frame (us) / median of a force (us) / CPU (ms "
         "per s "
         "of use: 30 frames, 1000 forces).\n\n" +
         markdownTable(headingsOf({"law and setting"}, distances_m), 1, rows) + "\n";
}

std::string pointsMarkdown(const ParetoResult& result) {
  std::vector<std::vector<std::string>> rows;
  for (const ParetoPoint& point : result.points) {
    const CpuCost& cost = point.cost;
    rows.push_back({point.run.kind.name, fmt::format("{:.2f}", cost.force_p999_us),
                    fmt::format("{:.0f}", cost.model_median_us), fmt::format("{:.2f}", cost.cpu_ms_per_s()),
                    fmt::format("{:.2f}", point.error.error_jnd.rms()),
                    fmt::format("{:.2f}", point.error_mm())});
  }
  return "Beside libraries that compute the paper's law, on the recordings and a synthetic table; errors at "
         "1 "
         "m with the harsher camera, 5 to 20 mm deep.\n\n" +
         markdownTable({"law and setting", "force, p99.9 (us)", "model of a frame (us)",
                        "CPU (ms per s of use)", "RMS error (JND)", "(mm)"},
                       1, rows);
}

std::string requirementsMarkdown(const ParetoResult& result) {
  std::vector<std::vector<std::string>> rows;
  for (const Requirement& requirement : requirementsOf(result)) {
    rows.push_back(
        {requirement.text,
         fmt::format("{:.3g}{}", requirement.measured, requirement.kept() ? "" : " (not kept)"),
         fmt::format("{} {:g}", requirement.at_least ? "at least" : "at most", requirement.limit)});
  }
  return "\n" + markdownTable({"what must hold", "measured", "limit"}, 1, rows);
}

}  // namespace

std::string paretoMarkdown(const ParetoResult& result) {
  return errorsMarkdown(result) + sensorMarkdown(result) + costsMarkdown(result) + pointsMarkdown(result) +
         requirementsMarkdown(result);
}

std::string surfaceErrorMarkdown(const ParetoResult& result) {
  std::vector<double> distances_m;
  for (const DistanceError& row : result.distance_errors) addOnce(distances_m, row.distance_m);
  std::vector<std::vector<std::string>> rows;
  for (const SurfaceKind kind : kSurfaceKinds) {
    auto& cells = rows.emplace_back(std::vector<std::string>{fmt::format("{} surface", nameOf(kind))});
    for (const double distance_m : distances_m) cells.push_back(rangeOf(result, kind, distance_m));
  }
  return markdownTable(headingsOf({"RMS error of `surface`, JND"}, distances_m), 1, rows);
}

}  // namespace hapticd::tools
