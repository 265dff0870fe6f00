// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/law_setting.h"

#include <fmt/format.h>

#include "config/settings.h"

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
  for (const rt::ForceLawRow& row : rt::kForceLaws) {
    settings.push_back({.law = row.law});
    if (row.reads_filtered) settings.push_back({.law = row.law, .filtered = true});
  }
  return settings;
}

std::unique_ptr<OfflineBox> boxFor(const LawSetting& setting, const rt::DepthModelParameters& camera) {
  auto box = std::make_unique<OfflineBox>(camera, rt::PoseParameters{}, rt::GridParameters{});
  rt::LiveParameters& live = box->parameters();
  live.law = setting.law;
  live.surface.fusion_frames = setting.fusion_frames;
  if (setting.filtered) live.filter = config::filterOfChoice();
  live.safety.max_force_n = 1e6;
  live.safety.max_slew_n_per_s = 1e9;
  return box;
}

rt::LiveParameters shippedParameters(const std::string& choice, double distance_m,
                                     const rt::DepthModelParameters& camera) {
  const config::Settings shipped;
  if (choice == config::kAutomaticLaw) {
    const config::SurfaceAsSeen seen = config::asSeenBy(camera, distance_m);
    return config::liveWith(shipped, config::chooseLaw(shipped, seen));
  }
  rt::LiveParameters live = shipped.effectiveLive();
  live.law = rt::withWord<ForceLaw>(choice).value_or(live.law);
  return live;
}

std::unique_ptr<OfflineBox> shippedBox(const std::string& choice, double distance_m,
                                       const rt::DepthModelParameters& camera) {
  auto box = std::make_unique<OfflineBox>(camera, rt::PoseParameters{}, rt::GridParameters{});
  const double engage_ramp_s = box->parameters().safety.engage_ramp_s;
  box->parameters() = shippedParameters(choice, distance_m, camera);
  box->parameters().safety.engage_ramp_s = engage_ramp_s;
  return box;
}

}  // namespace hapticd::tools
