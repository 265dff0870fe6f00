// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/settings.h"
#include "rt/parameters.h"
#include "rt/words.h"

namespace hapticd::config {

/// The word of a law, and of a choice, as in force.law.
constexpr std::string_view nameOf(rt::ForceLaw law) {
  return rt::wordOf(law);
}
constexpr std::string_view nameOf(const LawChoice& choice) {
  return choice ? nameOf(*choice) : kAutomaticLaw;
}

/// What `hapticbench pareto` measured of a law in one setting at one distance.
struct MeasuredLaw {
  rt::ForceLaw law;
  bool filtered;      ///< depth passes filterOfChoice(); only laws on points have a filter
  double distance_m;  ///< of the surface from the camera: stands for a class of distances
  double error_m;  ///< RMS force error against the true surface, with the harsher noise, over the stiffness
  double cpu_ms_per_s;  ///< CPU time per second of use: 30 frames modelled, 1000 forces
};

/// All of them.
std::span<const MeasuredLaw> measuredLaws();

/// The filter that `filtered` stands for.
constexpr rt::FilterParameters filterOfChoice() {
  return {.temporal_frames = 8, .hold_frames = 3, .spatial_radius_px = 2};
}

/// The class of a distance: that of measuredLaws() which is nearest in ratio. `before_m`: the class so far, 0
/// for none; it is kept until the distance is a twentieth beyond its border, so that it does not change to
/// and fro.
double distanceClass_m(double distance_m, double before_m);

/// A law with its filter, and why.
struct LawDecision {
  rt::ForceLaw law = rt::ForceLaw::surface;
  bool filtered = false;
  double error_n = 0;   ///< expected RMS force error
  bool within = false;  ///< the error is within the one that was allowed
  std::string reason;   ///< one sentence
};

/// The cheapest of the measured laws whose error at that distance class is at most `max_error_n`; where there
/// is none, the cheapest of those within a fifth of the most accurate one's error.
LawDecision chooseLaw(double max_error_n, double stiffness_n_per_m, double class_m);

/// `settings.live` with what was decided.
rt::LiveParameters liveWith(const Settings& settings, const LawDecision& decision);

/// `settings.live` with each law that may act: the one that is named, or all that `auto` comes to, one for
/// each class of distances.
std::vector<rt::LiveParameters> lawsThatMayAct(const Settings& settings);

}  // namespace hapticd::config
