// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/pareto/laws_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <tuple>

#include "config/law_choice.h"
#include "tools/hapticbench/accuracy/accuracy_study.h"
#include "tools/hapticbench/pareto/cost_study.h"

namespace hapticd::tools {
namespace {

/// Returns a row as a line of the table, with as many decimals as repeated measurements agree in.
std::string lineOf(const LawAtDistance& row) {
  const config::SurfaceAsSeen seen = config::asSeenBy(rt::DepthModelParameters{}, row.distance_m);
  return fmt::format("{{rt::ForceLaw::{}, {}, {:.6f}, {:.6f}, {:.6f}, {:.2f}}},\n", nameOf(row.setting.law),
                     row.setting.filtered, seen.noise_m, row.error_m, seen.pitch_m, row.cost.cpu_ms_per_s());
}

}  // namespace

std::string lawsTable(std::vector<LawAtDistance> rows, const std::string& command) {
  std::ranges::sort(rows, {}, [](const LawAtDistance& row) { return std::tie(row.setting, row.distance_m); });
  fmt::memory_buffer text;
  fmt::format_to(std::back_inserter(text),
                 "// SPDX-License-Identifier: Apache-2.0\n// Written by `{}`.\n// law, filtered, noise m, "
                 "RMS force error over stiffness m, pitch m, CPU ms "
                 "per second of use\n",
                 command);
  for (const LawAtDistance& row : rows) fmt::format_to(std::back_inserter(text), "{}", lineOf(row));
  return fmt::to_string(text);
}

std::map<LawSetting, ForceErrors> errorsOf(const std::vector<LawSetting>& settings, double distance_m,
                                           int pushes) {
  AccuracyOptions options;
  options.scenes = {"plane", "sphere", "plane30"};
  options.settings = settings;
  options.distances_m = {distance_m};
  options.noises = {SceneNoise::harsh};
  options.pushes = pushes;
  options.hold_frames = 0;
  std::map<LawSetting, ForceErrors> errors;
  for (const AccuracyRow& row : measureAccuracy(options)) errors[row.setting].add(row.error);
  return errors;
}

std::vector<LawAtDistance> measureLaws(const LawsTableOptions& options,
                                       const std::function<void(const std::string&)>& progress) {
  const std::vector<LawSetting> settings = shippedSettings();
  std::vector<ContenderKind> kinds;
  for (const LawSetting& setting : settings) kinds.push_back(ours(setting));
  std::vector<LawAtDistance> rows;
  for (const double distance_m : options.distances_m) {
    if (progress) progress(fmt::format("laws at {} m", distance_m));
    const auto errors = errorsOf(settings, distance_m, options.pushes);
    const std::vector<ContenderCost> costs =
        measureCosts(slopeAt(distance_m), kinds, {options.seconds, options.repeats, 0});
    for (std::size_t i = 0; i < settings.size(); ++i) {
      rows.push_back({settings[i], distance_m,
                      errors.at(settings[i]).error_n.rms() / rt::SpringParameters{}.stiffness_n_per_m,
                      CpuCost::of(costs[i].samples)});
    }
  }
  return rows;
}

}  // namespace hapticd::tools
