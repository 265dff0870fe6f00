#include "tools/hapticbench/pareto/setting_error.h"

#include <set>

#include "tools/hapticbench/accuracy/accuracy_study.h"
#include "tools/hapticbench/pareto/fused_error.h"

namespace hapticd::tools {
namespace {

/// The combinations that `settings` span.
AccuracyOptions optionsOf(const std::vector<LawSetting>& settings) {
  std::set<rt::ForceLaw> laws;
  std::set<double> edges_m;
  std::set<bool> filters;
  for (const LawSetting& setting : settings) {
    laws.insert(setting.law);
    edges_m.insert(setting.voxel_edge_m);
    filters.insert(setting.filtered);
  }
  AccuracyOptions options;
  options.laws.assign(laws.begin(), laws.end());
  options.voxel_edges_m.assign(edges_m.begin(), edges_m.end());
  options.filters.assign(filters.begin(), filters.end());
  options.noises = {SceneNoise::sensor};
  options.hold_frames = 0;
  return options;
}

}  // namespace

ErrorsOfSettings errorsOf(const std::vector<LawSetting>& settings, const std::vector<std::string>& scenes,
                          double distance_m, int pushes) {
  // apart, since only one of them has voxel edges to choose from
  std::vector<LawSetting> with_field, without_field;
  for (const LawSetting& setting : settings) {
    if (setting.fusion_frames > 1) continue;
    (setting.law == rt::ForceLaw::surface ? with_field : without_field).push_back(setting);
  }
  ErrorsOfSettings errors;
  for (const std::vector<LawSetting>& part : {with_field, without_field}) {
    if (part.empty()) continue;
    AccuracyOptions options = optionsOf(part);
    options.scenes = scenes;
    options.distances_m = {distance_m};
    options.pushes = pushes;
    for (const AccuracyRow& row : measureAccuracy(options)) {
      errors[{row.law, row.voxel_edge_m, row.filtered, 1}].add(row.against_surface);
    }
  }
  for (const LawSetting& setting : settings) {
    if (setting.fusion_frames > 1) errors[setting] = followedError(setting, scenes, distance_m, pushes);
  }
  return errors;
}

}  // namespace hapticd::tools
