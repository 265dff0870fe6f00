// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/speed_report.h"

#include <fmt/format.h>

#include <iterator>
#include <nlohmann/json.hpp>

namespace hapticd::tools {
namespace {

void addRows(fmt::memory_buffer& text, std::string_view heading,
             const std::vector<Measurement>& measurements) {
  fmt::format_to(std::back_inserter(text), "  {:<34}{:>11}{:>11}{:>11}{:>14}{:>14}\n", heading, "median us",
                 "p99 us", "max us", "x nanoflann", "error N");
  for (const Measurement& m : measurements) {
    fmt::format_to(std::back_inserter(text), "    {:<32}{:>11.2f}{:>11.2f}{:>11.2f}{:>14}{:>14}\n", m.what,
                   m.time.median_us, m.time.p99_us, m.time.max_us,
                   fmt::format("1/{:.1f}", 1 / m.slower_than_nanoflann),
                   m.largest_force_error_n < 0 ? "" : fmt::format("{:.1e}", m.largest_force_error_n));
  }
}

nlohmann::ordered_json rowsOf(const std::vector<Measurement>& measurements) {
  auto rows = nlohmann::ordered_json::array();
  for (const Measurement& m : measurements) {
    nlohmann::ordered_json row{{"what", m.what},
                               {"count", m.time.count},
                               {"median_us", m.time.median_us},
                               {"p99_us", m.time.p99_us},
                               {"max_us", m.time.max_us},
                               {"median_by_nanoflann", m.slower_than_nanoflann}};
    if (m.largest_force_error_n >= 0) row["largest_force_error_n"] = m.largest_force_error_n;
    rows.push_back(row);
  }
  return rows;
}

}  // namespace

std::string speedTable(const std::vector<SceneSpeed>& scenes, int cpu) {
  fmt::memory_buffer text;
  fmt::format_to(std::back_inserter(text),
                 "The paper's law (k_s 500 N/m, D_thresh 0.04 m, N_min 10, N_max 100) on one core{}.\n"
                 "error: largest difference from a double-precision search of all points.\n",
                 cpu < 0 ? ", not pinned" : fmt::format(", CPU {}", cpu));
  for (const SceneSpeed& scene : scenes) {
    fmt::format_to(
        std::back_inserter(text),
        "\n{}: {} points, {:.0f} of them in reach (mean), {} ambiguous positions left out of the errors\n",
        scene.scene, scene.points, scene.reach_points, scene.ambiguous);
    addRows(text, "modelling a frame", scene.modelling);
    addRows(text, "one force, scattered positions", scene.scattered);
    addRows(text, "one force, along a path", scene.path);
  }
  return fmt::to_string(text);
}

std::string speedJson(const std::vector<SceneSpeed>& scenes, int cpu) {
  nlohmann::ordered_json document{{"benchmark", "speed"}, {"cpu", cpu}};
  auto& list = document["scenes"] = nlohmann::ordered_json::array();
  for (const SceneSpeed& scene : scenes) {
    list.push_back({{"scene", scene.scene},
                    {"points", scene.points},
                    {"reach_points", scene.reach_points},
                    {"ambiguous_positions", scene.ambiguous},
                    {"modelling", rowsOf(scene.modelling)},
                    {"force_scattered", rowsOf(scene.scattered)},
                    {"force_path", rowsOf(scene.path)}});
  }
  return document.dump(2) + "\n";
}

}  // namespace hapticd::tools
