// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/pareto/pareto_markdown.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace hapticd::tools {
namespace {

template <typename... Arguments>
void put(fmt::memory_buffer& text, fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  fmt::format_to(std::back_inserter(text), format, std::forward<Arguments>(arguments)...);
}

/// Appends `value` unless it is there.
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

void beginTable(fmt::memory_buffer& text, const char* heads, const char* rules,
                const std::vector<double>& distances_m) {
  put(text, "{}", heads);
  for (const double distance_m : distances_m) put(text, " {:g} m |", distance_m);
  put(text, "\n{}", rules);
  for (std::size_t i = 0; i < distances_m.size(); ++i) put(text, "---:|");
  put(text, "\n");
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

struct Expected {
  std::vector<std::string> laws;
  std::vector<SceneNoise> noises;
  std::vector<double> distances_m;
};

Expected axesOf(const ParetoResult& result) {
  Expected axes;
  for (const DistanceError& row : result.distance_errors) {
    addOnce(axes.laws, row.law);
    addOnce(axes.noises, row.noise);
    addOnce(axes.distances_m, row.distance_m);
  }
  return axes;
}

/// Appends a table with a row for each law and noise. `figure` turns a DistanceError into the text of a cell.
template <typename Figure>
void putExpected(fmt::memory_buffer& text, const ParetoResult& result, const Expected& axes, const char* head,
                 Figure figure) {
  beginTable(text, head, "|---|---|", axes.distances_m);
  for (const std::string& law : axes.laws) {
    for (const SceneNoise noise : axes.noises) {
      put(text, "| `{}` | {} |", law, cameraOf(noise));
      for (const double distance_m : axes.distances_m)
        put(text, " {} |", cellOf(result, law, noise, distance_m, figure));
      put(text, "\n");
    }
  }
  put(text, "\n");
}

void putErrors(fmt::memory_buffer& text, const ParetoResult& result) {
  const Expected axes = axesOf(result);
  if (axes.laws.empty()) return;
  put(text,
      "RMS error of the force in JND on strokes 8 mm deep (4 N; 1 JND = 0.28 N is just noticed), on flat / "
      "curved / moving surfaces: planes to 30 degrees, a ball of 100 mm and a rod of 80 mm, a plane at "
      "0.3 m/s.\n\n");
  putExpected(text, result, axes, "| law | camera |",
              [](const DistanceError& row) { return twoDigits(row.rms_jnd); });
  Expected constraints = axes;
  std::erase_if(constraints.laws, [](const std::string& law) { return law.ends_with("springs"); });
  if (constraints.laws.empty()) return;
  put(text,
      "The same over the least that the sensor's noise allows with 40 mm of surface (8 frames, 3 where it "
      "moves); below 1 a flat surface is larger than that:\n\n");
  putExpected(text, result, constraints, "| times the floor | camera |",
              [](const DistanceError& row) { return row.by_floor ? twoDigits(*row.by_floor) : "-"; });
  put(text, "Contact lost, % of the stroke:\n\n");
  putExpected(text, result, constraints, "| contact lost | camera |",
              [](const DistanceError& row) { return twoDigits(row.lost_percent); });
}

/// Appends one row of the sensor's limits for a noise model.
template <typename Figure>
void putLimit(fmt::memory_buffer& text, const ParetoResult& result, SceneNoise noise, const char* head,
              Figure figure) {
  put(text, "{}", head);
  for (const SensorLimit& limit : result.sensor_limits) {
    if (limit.noise == noise) put(text, " {} |", twoDigits(figure(limit)));
  }
  put(text, "\n");
}

void putSensorLimits(fmt::memory_buffer& text, const ParetoResult& result) {
  if (result.sensor_limits.empty()) return;
  std::vector<SceneNoise> noises;
  std::vector<double> distances_m;
  for (const SensorLimit& limit : result.sensor_limits) {
    addOnce(noises, limit.noise);
    addOnce(distances_m, limit.distance_m);
  }
  put(text,
      "What no law can do better, because of the sensor: the step of its depth, bodies of fewer than eight "
      "pixels, and the least error (JND) on a patch of that side, still, 8 frames.\n\n");
  beginTable(text, "| the sensor | camera |", "|---|---|", distances_m);
  putLimit(text, result, noises.front(), "| one step of depth, mm | all |",
           [](const SensorLimit& limit) { return limit.raw_unit_mm; });
  putLimit(text, result, noises.front(), "| narrowest body, mm | all |",
           [](const SensorLimit& limit) { return limit.narrowest_mm; });
  for (const SceneNoise noise : noises) {
    const auto row = [&](const char* what, auto figure) {
      putLimit(text, result, noise, fmt::format("| {} | {} |", what, cameraOf(noise)).c_str(), figure);
    };
    row("flat, 40 mm", [](const SensorLimit& limit) { return limit.flat_40_mm_jnd; });
    row("flat, 160 mm", [](const SensorLimit& limit) { return limit.flat_160_mm_jnd; });
    row("curved, 40 mm", [](const SensorLimit& limit) { return limit.curved_40_mm_jnd; });
  }
  put(text, "\n");
}

void putCosts(fmt::memory_buffer& text, const ParetoResult& result) {
  std::vector<double> distances_m;
  for (const LawAtDistance& row : result.laws) {
    if (std::ranges::find(kCostDistances_m, row.distance_m) != std::end(kCostDistances_m))
      addOnce(distances_m, row.distance_m);
  }
  if (distances_m.empty()) return;
  put(text,
      "Cost on a plane turned by 30 degrees: median of a frame (us) / median of a force (us) / CPU (ms per s "
      "of use: 30 frames, 1000 forces).\n\n");
  beginTable(text, "| law and setting |", "|---|", distances_m);
  for (const LawSetting& setting : shippedSettings()) {
    put(text, "| {} |", nameOf(setting));
    for (const LawAtDistance& row : result.laws) {
      if (row.setting != setting || std::ranges::find(distances_m, row.distance_m) == distances_m.end())
        continue;
      put(text, " {:.0f} / {:.2f} / {:.2f} |", row.cost.model_median_us, row.cost.force_median_us,
          row.cost.cpu_ms_per_s());
    }
    put(text, "\n");
  }
  put(text, "\n");
}

/// The range over the noise models, "0.14 to 0.16"; "-" where nothing was measured.
std::string rangeOf(const ParetoResult& result, SurfaceKind kind, double distance_m) {
  std::vector<double> errors_jnd;
  for (const DistanceError& row : result.distance_errors) {
    if (row.law == "surface" && row.kind == kind && row.distance_m == distance_m)
      errors_jnd.push_back(row.rms_jnd);
  }
  if (errors_jnd.empty()) return "-";
  const auto [least, most] = std::ranges::minmax(errors_jnd);
  const std::string from = twoDigits(least), to = twoDigits(most);
  return from == to ? from : fmt::format("{} to {}", from, to);
}

void putPoints(fmt::memory_buffer& text, const ParetoResult& result) {
  put(text,
      "| law and setting | force, p99.9 (us) | model of a frame (us) | CPU (ms per s of use) | RMS error "
      "(JND) | (mm) |\n");
  put(text, "|---|---:|---:|---:|---:|---:|\n");
  for (const ParetoPoint& point : result.points) {
    put(text, "| {} | {:.2f} | {:.0f} | {:.2f} | {:.2f} | {:.2f} |\n", point.run.kind.name,
        point.cost.force_p999_us, point.cost.model_median_us, point.cost.cpu_ms_per_s(),
        point.error.error_jnd.rms(), point.error_mm());
  }
}

}  // namespace

std::string paretoMarkdown(const ParetoResult& result) {
  fmt::memory_buffer text;
  putErrors(text, result);
  putSensorLimits(text, result);
  putCosts(text, result);
  put(text,
      "Beside libraries that compute the paper's law, on the recordings and a made-up table; errors at 1 m "
      "with the harsher camera, 5 to 20 mm deep.\n\n");
  putPoints(text, result);
  put(text, "\n| what must hold | measured | limit |\n|---|---:|---:|\n");
  for (const ParetoRequirement& requirement : requirementsOf(result)) {
    put(text, "| {} | {:.3g}{} | {} {:g} |\n", requirement.text, requirement.measured,
        requirement.kept() ? "" : " (not kept)", requirement.at_least ? "at least" : "at most",
        requirement.limit);
  }
  return fmt::to_string(text);
}

std::string surfaceErrorMarkdown(const ParetoResult& result) {
  const Expected axes = axesOf(result);
  fmt::memory_buffer text;
  beginTable(text, "| RMS error of `surface`, JND |", "|---|", axes.distances_m);
  for (const SurfaceKind kind : kSurfaceKinds) {
    put(text, "| {} surface |", nameOf(kind));
    for (const double distance_m : axes.distances_m) put(text, " {} |", rangeOf(result, kind, distance_m));
    put(text, "\n");
  }
  return fmt::to_string(text);
}

}  // namespace hapticd::tools
