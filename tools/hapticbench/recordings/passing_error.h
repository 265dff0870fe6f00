// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "config/settings.h"
#include "rt/vec3.h"
#include "tools/hapticbench/force_series.h"
#include "tools/hapticbench/recordings/passed_place.h"
#include "tools/hapticbench/recordings/session.h"

namespace hapticd::tools {

/// One tick of a hand that something passes.
struct PassingTick {
  rt::Vec3 force_n;
  rt::Vec3 true_n;        ///< zero for a HIP in front of the surface
  bool covered = false;   ///< something nearer covers the place, or did within the last fifth of a second
  bool left_out = false;  ///< something is measured within 20 mm of the HIP, which may touch it
};

/// What a law did at one place or several.
struct PassingError {
  std::size_t left_out = 0;
  Exceedance ghost;          ///< free hand: force over 0.1 N
  Exceedance ghost_covered;  ///< of these ticks, those while something passes
  Exceedance error;          ///< pressing hand, while something passes: error over 0.5 N
  Exceedance change;         ///< the same of the difference from the mean force while nothing passed
  Exceedance calm;           ///< that difference while nothing passes: the sensor's own noise
  void add(const PassingError& other);
};

/// The hand is free where true_n is zero throughout, else it presses.
PassingError judgePassing(const std::vector<PassingTick>& ticks);

/// A HIP that waits `before_m` (positive) in front of the place's surface, or presses that far (negative)
/// behind it, while the session is played once forwards and once backwards.
PassingError passPlace(config::LawChoice law, const BenchSequence& session, const PassedPlace& place,
                       const rt::DepthModelParameters& camera, double before_m);

}  // namespace hapticd::tools
