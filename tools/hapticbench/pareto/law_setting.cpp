#include "tools/hapticbench/pareto/law_setting.h"

#include <fmt/format.h>

namespace hapticd::tools {

using rt::ForceLaw;

std::string nameOf(const LawSetting& setting) {
  std::string name(nameOf(setting.law));
  if (setting.law == ForceLaw::surface) name += fmt::format(" {:g} mm", 1000 * setting.voxel_edge_m);
  if (setting.filtered) name += ", filtered";
  if (setting.fusion_frames > 1) name += fmt::format(", {} fused", setting.fusion_frames);
  return name;
}

std::vector<LawSetting> allSettings() {
  std::vector<LawSetting> settings;
  for (const ForceLaw law : {ForceLaw::nearest_springs, ForceLaw::smooth_springs, ForceLaw::proxy}) {
    for (const bool filtered : {false, true}) settings.push_back({.law = law, .filtered = filtered});
  }
  for (const double edge_m : {0.005, 0.01, 0.02, 0.04}) {
    for (const bool filtered : {false, true}) {
      for (const int fused : {1, 8}) settings.push_back({ForceLaw::surface, edge_m, filtered, fused});
    }
  }
  return settings;
}

std::unique_ptr<OfflineBox> boxFor(const LawSetting& setting, const rt::DepthModelParameters& camera) {
  auto box = std::make_unique<OfflineBox>(camera, rt::PoseParameters{}, rt::GridParameters{});
  rt::LiveParameters& live = box->parameters();
  live.law = setting.law;
  live.surface = {.voxel_edge_m = setting.voxel_edge_m, .fusion_frames = setting.fusion_frames};
  if (setting.filtered) live.filter = kFilterOn;
  live.safety.max_force_n = 1e6;
  live.safety.max_slew_n_per_s = 1e9;
  return box;
}

}  // namespace hapticd::tools
