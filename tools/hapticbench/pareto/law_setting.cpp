// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/pareto/law_setting.h"

#include <fmt/format.h>

namespace hapticd::tools {

using rt::ForceLaw;

std::string nameOf(const LawSetting& setting) {
  std::string name(nameOf(setting.law));
  if (setting.filtered) name += ", filtered";
  const int frames = setting.fusion_frames;
  if (frames != LawSetting{}.fusion_frames)
    name += fmt::format(", {} frame{}", frames, frames == 1 ? "" : "s");
  return name;
}

std::vector<LawSetting> shippedSettings() {
  std::vector<LawSetting> settings;
  for (const ForceLaw law : {ForceLaw::nearest_springs, ForceLaw::smooth_springs, ForceLaw::proxy}) {
    for (const bool filtered : {false, true}) settings.push_back({.law = law, .filtered = filtered});
  }
  settings.push_back({.law = ForceLaw::surface});
  return settings;
}

std::vector<LawSetting> allSettings() {
  std::vector<LawSetting> settings = shippedSettings();
  settings.push_back({.law = ForceLaw::surface, .fusion_frames = 1});
  return settings;
}

std::unique_ptr<OfflineBox> boxFor(const LawSetting& setting, const rt::DepthModelParameters& camera) {
  auto box = std::make_unique<OfflineBox>(camera, rt::PoseParameters{}, rt::GridParameters{});
  rt::LiveParameters& live = box->parameters();
  live.law = setting.law;
  live.surface.fusion_frames = setting.fusion_frames;
  if (setting.filtered) live.filter = kFilterOn;
  live.safety.max_force_n = 1e6;
  live.safety.max_slew_n_per_s = 1e9;
  return box;
}

}  // namespace hapticd::tools
