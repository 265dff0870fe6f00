// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/shipped_law.h"

#include <algorithm>

#include "config/law_choice.h"

namespace hapticd::tools {

config::LawChoice shippedLawNamed(std::string_view name) {
  const auto* const law = std::ranges::find_if(
      kShippedLaws, [name](const config::LawChoice& candidate) { return nameOf(candidate) == name; });
  return law == kShippedLaws.end() ? std::nullopt : *law;
}

rt::LiveParameters shippedParameters(config::LawChoice law, double distance_m) {
  config::Settings settings;
  settings.force.law = law;
  if (law) return settings.effectiveLive();
  constexpr double kNoClassBefore = 0;
  const config::LawDecision decision = config::chooseLaw(
      settings.force.effectiveMaxError_n(settings.live.safety), settings.live.springs.stiffness_n_per_m,
      config::distanceClass_m(distance_m, kNoClassBefore));
  return config::liveWith(settings, decision);
}

std::unique_ptr<OfflineBox> shippedBox(config::LawChoice law, double distance_m,
                                       const rt::DepthModelParameters& camera) {
  auto box = std::make_unique<OfflineBox>(camera, rt::PoseParameters{}, rt::GridParameters{});
  const double engage_ramp_s = box->parameters().safety.engage_ramp_s;
  box->parameters() = shippedParameters(law, distance_m);
  box->parameters().safety.engage_ramp_s = engage_ramp_s;
  return box;
}

}  // namespace hapticd::tools
