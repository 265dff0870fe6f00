// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/palpation/palpation_report.h"

#include <fmt/format.h>

#include <iterator>
#include <nlohmann/json.hpp>

namespace hapticd::tools {
namespace {

nlohmann::json jsonOf(const rt::Vec3& v) {
  return {v.x, v.y, v.z};
}

}  // namespace

std::string palpationText(const PalpationMap& map) {
  std::string text = fmt::format("{:>27} {:>8} {:>17} {:>15} {:>8} {:>8} {:>8}\n", "place in mm", "samples",
                                 "K in N/m", "B in N s/m", "upper K", "lower K", "layer mm");
  for (const PalpatedCell& cell : map.cells) {
    const rt::Vec3& p = cell.position_m_in_world;
    const StiffnessEstimate& k = cell.estimate;
    fmt::format_to(std::back_inserter(text),
                   "{:>9.1f}{:>9.1f}{:>9.1f} {:>8} {:>8.1f} +-{:>6.1f} {:>7.3f} +-{:>5.3f} {:>8.1f} {:>8.1f} "
                   "{:>8}\n",
                   1e3 * p.x, 1e3 * p.y, 1e3 * p.z, cell.samples, k.stiffness_n_per_m,
                   k.stiffness_error_n_per_m, k.damping_n_s_per_m, k.damping_error_n_s_per_m,
                   cell.layers.upper_n_per_m, cell.layers.lower_n_per_m,
                   cell.layers.layered ? fmt::format("{:.1f}", 1e3 * cell.layers.layer_m) : "-");
  }
  if (!map.nodule) return text + "No place is stiffer than its surroundings by a quarter.\n";
  const Nodule& nodule = *map.nodule;
  const rt::Vec3& p = nodule.position_m_in_world;
  return text + fmt::format(
                    "Stiffer place: {:.1f} {:.1f} {:.1f} mm, {:.0f} N/m in surroundings of {:.0f} N/m, from "
                    "a depth of {:.1f} mm\n",
                    1e3 * p.x, 1e3 * p.y, 1e3 * p.z, nodule.stiffness_n_per_m, nodule.surroundings_n_per_m,
                    1e3 * nodule.layer_m);
}

std::string palpationJson(const PalpationMap& map) {
  nlohmann::json cells = nlohmann::json::array();
  for (const PalpatedCell& cell : map.cells) {
    cells.push_back({{"position_m_in_world", jsonOf(cell.position_m_in_world)},
                     {"samples", cell.samples},
                     {"stiffness_n_per_m", cell.estimate.stiffness_n_per_m},
                     {"stiffness_error_n_per_m", cell.estimate.stiffness_error_n_per_m},
                     {"damping_n_s_per_m", cell.estimate.damping_n_s_per_m},
                     {"damping_error_n_s_per_m", cell.estimate.damping_error_n_s_per_m},
                     {"layered", cell.layers.layered},
                     {"upper_stiffness_n_per_m", cell.layers.upper_n_per_m},
                     {"lower_stiffness_n_per_m", cell.layers.lower_n_per_m},
                     {"layer_m", cell.layers.layer_m}});
  }
  nlohmann::json nodule;
  if (map.nodule) {
    nodule = {{"position_m_in_world", jsonOf(map.nodule->position_m_in_world)},
              {"stiffness_n_per_m", map.nodule->stiffness_n_per_m},
              {"surroundings_n_per_m", map.nodule->surroundings_n_per_m},
              {"layer_m", map.nodule->layer_m}};
  }
  return nlohmann::json{{"cells", cells}, {"nodule", nodule}}.dump(2) + "\n";
}

}  // namespace hapticd::tools
