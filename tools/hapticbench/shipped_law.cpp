// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/shipped_law.h"

#include <algorithm>

#include "config/law_choice.h"

namespace hapticd::tools {

std::string_view nameOf(config::LawChoice law) {
  switch (law) {
    case config::LawChoice::automatic:
      return "auto";
    case config::LawChoice::nearest_springs:
      return "nearest_springs";
    case config::LawChoice::smooth_springs:
      return "smooth_springs";
    case config::LawChoice::proxy:
      return "proxy";
    case config::LawChoice::surface:
      return "surface";
  }
  return "unknown";
}

config::LawChoice shippedLawNamed(std::string_view name) {
  const auto* const law = std::ranges::find_if(
      kShippedLaws, [name](config::LawChoice candidate) { return nameOf(candidate) == name; });
  return law == kShippedLaws.end() ? config::LawChoice::automatic : *law;
}

rt::LiveParameters shippedParameters(config::LawChoice law, double distance_m) {
  config::Settings settings;
  settings.force.law = law;
  if (law != config::LawChoice::automatic) return settings.effectiveLive();
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
