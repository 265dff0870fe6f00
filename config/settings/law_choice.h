// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/settings/settings.h"
#include "rt/base/parameters.h"
#include "rt/base/words.h"

namespace hapticd::config {

/// The word of a law, and of a choice, as in force.law.
constexpr std::string_view nameOf(rt::ForceLaw law) {
  return rt::wordOf(law);
}
constexpr std::string_view nameOf(const LawChoice& choice) {
  return choice ? nameOf(*choice) : kAutomaticLaw;
}

/// What the error and the cost of a law follow from, for a camera and the distance of the surface.
struct SurfaceAsSeen {
  /// Standard deviation of the mean of Z over 12 x 12 pixels, about the smallest support of a surface; 0: not
  /// known.
  double noise_m = 0;
  double pitch_m = 0;  ///< distance between the points of adjacent pixels

  friend bool operator==(const SurfaceAsSeen&, const SurfaceAsSeen&) = default;
};

/// Returns how a camera sees a surface. A camera whose noise is not known counts as a Kinect v1.
SurfaceAsSeen asSeenBy(const rt::DepthModelParameters& camera, double distance_m);

/// Measurement of a law by `hapticbench pareto`, in one setting at one distance from a camera.
struct MeasuredLaw {
  rt::ForceLaw law;
  bool filtered;   ///< depth is filtered by filterOfChoice(); only for laws on points
  double noise_m;  ///< see SurfaceAsSeen
  /// RMS force error against the true surface with that noise, divided by the stiffness.
  double error_m;
  double pitch_m;  ///< see SurfaceAsSeen
  /// CPU time per second of use with that pitch: 30 frames modelled, 1000 forces.
  double cpu_ms_per_s;
};

/// Returns all measurements; those of one law and filter follow each other with rising noise and pitch.
std::span<const MeasuredLaw> measuredLaws();

/// Returns the filter that `filtered` refers to.
constexpr rt::FilterParameters filterOfChoice() {
  return {.temporal_frames = 8, .hold_frames = 3, .spatial_radius_px = 2};
}

/// Returns the RMS force error that is expected of a law, divided by the stiffness: interpolated between
/// measuredLaws() on logarithmic axes, and beyond them that of the first or the last.
double expectedError_m(rt::ForceLaw law, bool filtered, double noise_m);

/// Returns `before` as long as noise and pitch are near it, which a twentieth of the distance ends, else
/// `seen`: so the choice does not alternate while a surface is stroked. `before`: {} if there is none.
SurfaceAsSeen steady(const SurfaceAsSeen& seen, const SurfaceAsSeen& before);

/// A chosen law with its filter, and the reason.
struct LawDecision {
  rt::ForceLaw law = rt::lawThat(&rt::ForceLawRow::suits_every_scene);
  bool filtered = false;
  double error_n = 0;   ///< expected RMS force error
  bool within = false;  ///< the error is within the allowed one
  std::string reason;   ///< one sentence
};

/// Chooses the cheapest of the measured laws whose expected error is at most `max_error_n`; if there is none,
/// the cheapest of those within a fifth of the most accurate one's error. The error follows from the noise,
/// the cost from the pitch.
LawDecision chooseLaw(double max_error_n, double stiffness_n_per_m, const SurfaceAsSeen& seen);

/// The same for the scene of `settings`: if a stand-off fixture is enabled, the law that carries stand-offs.
LawDecision chooseLaw(const Settings& settings, const SurfaceAsSeen& seen);

/// Returns `settings.live` with the chosen law and filter, and the clearance of the stand-off fixtures.
rt::LiveParameters liveWith(const Settings& settings, const LawDecision& decision);

/// Returns `settings.live` for each law that may be used: the configured one, or all that `auto` may choose,
/// each once.
std::vector<rt::LiveParameters> lawsThatMayAct(const Settings& settings);

}  // namespace hapticd::config
