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

/// Measurement of a law by `hapticbench pareto`, in one setting at one distance.
struct MeasuredLaw {
  rt::ForceLaw law;
  bool filtered;      ///< depth is filtered by filterOfChoice(); only for laws on points
  double distance_m;  ///< of the surface from a Kinect v1; represents a class of distances
  /// RMS force error against the true surface, with the harsher noise, divided by the stiffness.
  double error_m;
  double cpu_ms_per_s;  ///< CPU time per second of use: 30 frames modelled, 1000 forces
};

/// Returns all measurements.
std::span<const MeasuredLaw> measuredLaws();

/// Returns the filter that `filtered` refers to.
constexpr rt::FilterParameters filterOfChoice() {
  return {.temporal_frames = 8, .hold_frames = 3, .spatial_radius_px = 2};
}

/// Returns the distance at which a Kinect v1, with which measuredLaws() were measured, has the noise that a
/// camera has at a distance. The error of a law follows from the noise; the distance itself is returned for a
/// Kinect v1 and for a camera whose noise is not known.
double equivalentDistance_m(const rt::DepthModelParameters& camera, double distance_m);

/// Returns the class of a distance: the distance in measuredLaws() that is nearest in ratio. `before_m`: the
/// previous class, or 0; it is kept until the distance is a twentieth beyond its border, to prevent it from
/// alternating.
double distanceClass_m(double distance_m, double before_m);

/// A chosen law with its filter, and the reason.
struct LawDecision {
  rt::ForceLaw law = rt::ForceLaw::surface;
  bool filtered = false;
  double error_n = 0;   ///< expected RMS force error
  bool within = false;  ///< the error is within the allowed one
  std::string reason;   ///< one sentence
};

/// Chooses the cheapest of the measured laws whose error in that distance class is at most `max_error_n`; if
/// there is none, the cheapest of those within a fifth of the most accurate one's error.
LawDecision chooseLaw(double max_error_n, double stiffness_n_per_m, double class_m);

/// The same for the scene of `settings`: if a stand-off fixture is enabled, `surface`, because it is the only
/// law that stand-offs can act with.
LawDecision chooseLaw(const Settings& settings, double class_m);

/// Returns `settings.live` with the chosen law and filter, and the clearance of the stand-off fixtures.
rt::LiveParameters liveWith(const Settings& settings, const LawDecision& decision);

/// Returns `settings.live` for each law that may be used: the configured one, or all that `auto` may choose,
/// one per class of distances.
std::vector<rt::LiveParameters> lawsThatMayAct(const Settings& settings);

}  // namespace hapticd::config
