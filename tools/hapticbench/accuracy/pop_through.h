// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include "rt/parameters.h"

namespace hapticd::tools {

/// The outcome of a push into a surface.
struct PopThrough {
  bool popped = false;           ///< the HIP popped through
  double largest_n = 0;          ///< the pop-through force where it did: the largest one before that
  std::size_t largest_tick = 0;  ///< the first tick with that force
  bool dipped = false;  ///< the force fell as if the surface gave way, but then exceeded what it was before

  /// Popped through before a force of `limit_n` was reached.
  bool under(double limit_n) const { return popped && largest_n < limit_n; }
};

/// Judges the force of a law along a push: `outward_n` is its component out of the surface tick by tick while
/// the HIP goes inward (or the surface comes towards it), `ideal_n` that of a spring to an ideal constraint,
/// which rises. The surface gives way where the force
/// - falls below half of its largest value so far, once that was at least 0.25 N (half a millimetre at
///   500 N/m, more than noise does to a force near zero), or
/// - is not outward at all although an ideal constraint pushes with 0.5 N or more.
/// Where the force later in the push exceeds that largest value, noise made the surface step back for a
/// moment, but it has held. Both spans are of the same length.
PopThrough judgePush(std::span<const double> outward_n, std::span<const double> ideal_n);

/// The largest force of the paper's springs in front of a plane without noise that faces the camera
/// `depth_m` away, newtons: the force at which they let the HIP through. In closed form, the mean over the
/// disc that holds the nearest `max_points` pixels.
double popThroughForceOnPlane_n(const rt::SpringParameters& springs, const rt::DepthModelParameters& camera,
                                double depth_m);

}  // namespace hapticd::tools
