// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "rt/vec3.h"
#include "tools/hapticbench/recordings/passed_place.h"
#include "tools/hapticbench/recordings/session.h"
#include "tools/hapticbench/statistics.h"

namespace hapticd::tools {

/// One tick of a hand in front of which something passes.
struct PassingTick {
  rt::Vec3 force_n;
  rt::Vec3 true_n;        ///< zero for a HIP in front of the surface
  bool covered = false;   ///< something nearer covers the position, or did within the last fifth of a second
  bool left_out = false;  ///< something is measured within 20 mm of the HIP, which may touch it
};

/// Errors of a law at one position or several.
struct PassingError {
  std::size_t left_out = 0;
  Exceedance ghost;          ///< free hand: force over 0.1 N
  Exceedance ghost_covered;  ///< of these ticks, those while something passes
  Exceedance error;          ///< pressing hand, while something passes: error over 0.5 N
  Exceedance change;         ///< the same of the difference from the mean force while nothing passed
  Exceedance calm;           ///< that difference while nothing passes: the sensor's own noise
  void add(const PassingError& other);
};

/// The hand is free if true_n is zero at all ticks, else it presses.
PassingError judgePassing(const std::vector<PassingTick>& ticks);

/// A HIP that waits `before_m` (positive) in front of the surface at a position, or presses that far
/// (negative) behind it, while the session is played once forwards and once backwards.
PassingError passPlace(const std::string& law, const BenchSequence& session, const PassedPlace& place,
                       const CameraDisparity& camera, double before_m);

}  // namespace hapticd::tools
