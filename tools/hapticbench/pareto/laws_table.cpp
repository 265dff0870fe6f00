#include "tools/hapticbench/pareto/laws_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <tuple>

#include "tools/hapticbench/pareto/cost_study.h"
#include "tools/hapticbench/pareto/setting_error.h"

namespace hapticd::tools {
namespace {

using rt::ForceLaw;

/// The places of decimals that the table keeps: what is measured again differs in the later ones.
std::string lineOf(const LawAtDistance& row) {
  const LawSetting& setting = row.setting;
  return fmt::format("{{rt::ForceLaw::{}, {:g}, {}, {:.1f}, {:.6f}, {:.2f}}},\n", nameOf(setting.law),
                     setting.voxel_edge_m, setting.filtered, row.distance_m, row.error_m, row.cpu_ms_per_s);
}

}  // namespace

std::vector<LawSetting> tableSettings() {
  std::vector<LawSetting> settings{{.law = ForceLaw::nearest_springs}, {.law = ForceLaw::smooth_springs}};
  for (const bool filtered : {false, true}) {
    settings.push_back({.law = ForceLaw::proxy, .filtered = filtered});
    for (const double edge_m : {0.005, 0.01, 0.02}) {
      settings.push_back({ForceLaw::surface, edge_m, filtered, 1});
    }
  }
  std::sort(settings.begin(), settings.end());
  return settings;
}

std::string lawsTable(std::vector<LawAtDistance> rows, const std::string& command) {
  std::sort(rows.begin(), rows.end(), [](const LawAtDistance& a, const LawAtDistance& b) {
    return std::tie(a.setting, a.distance_m) < std::tie(b.setting, b.distance_m);
  });
  fmt::memory_buffer text;
  fmt::format_to(std::back_inserter(text),
                 "// Written by `{}`.\n// law, voxel edge m, filtered, distance m, RMS force error over "
                 "stiffness m, CPU ms per second of use\n",
                 command);
  for (const LawAtDistance& row : rows) fmt::format_to(std::back_inserter(text), "{}", lineOf(row));
  return fmt::to_string(text);
}

std::vector<LawAtDistance> measureLaws(const LawsTableOptions& options,
                                       const std::function<void(const std::string&)>& progress) {
  const std::vector<LawSetting> settings = tableSettings();
  std::vector<ContenderKind> kinds;
  for (const LawSetting& setting : settings) kinds.push_back(ours(setting));
  std::vector<LawAtDistance> rows;
  for (const double distance_m : options.distances_m) {
    if (progress) progress(fmt::format("laws at {} m", distance_m));
    const ErrorsOfSettings errors =
        errorsOf(settings, {"plane", "sphere", "plane30"}, distance_m, options.pushes);
    const std::vector<ContenderCost> costs =
        measureCosts(slopeAt(distance_m), kinds, {options.seconds, options.repeats, 0});
    for (std::size_t i = 0; i < settings.size(); ++i) {
      rows.push_back({settings[i], distance_m,
                      errors.at(settings[i]).error_n.rms() / rt::SpringParameters{}.stiffness_n_per_m,
                      CpuCost::of(costs[i].samples).cpu_ms_per_s()});
    }
  }
  return rows;
}

}  // namespace hapticd::tools
