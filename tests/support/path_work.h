// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "rt/base/vec3.h"

namespace hapticd::test {

/// What a hand gets from a force that may depend on the hand's history, along a path: Simpson's rule over
/// steps that are halved until that changes the work by less than a tolerance.
///
/// `System` has `Vec3 tick(Vec3)`, which moves the hand and returns the force there, `save()`, which returns
/// the whole history, and `restore()`.
template <typename System>
class PathWork {
 public:
  /// `tolerance_j`: of each step.
  PathWork(System& system, double tolerance_j) : system_(system), tolerance_j_(tolerance_j) {}

  void start(const rt::Vec3& place_m) {
    place_ = place_m;
    force_ = system_.tick(place_m);
  }
  void moveTo(const rt::Vec3& to_m) { advance(to_m, 0); }

  /// Work of the force on the hand so far.
  double got_j() const { return got_j_; }
  /// Bound of the integration error: the sum of the changes by halving.
  double error_j() const { return error_j_; }
  /// Largest `got_j() - error_j()` so far: more than the hand gave at any time.
  double gained_j() const { return gained_j_; }

 private:
  static constexpr int kMaxHalvings = 22;

  static double simpson_j(const rt::Vec3& first, const rt::Vec3& middle, const rt::Vec3& last,
                          const rt::Vec3& way) {
    return dot(first + 4 * middle + last, way) / 6;
  }

  void advance(const rt::Vec3& to, int halvings) {
    const auto memory = system_.save();
    const rt::Vec3 from = place_;
    const rt::Vec3 way = to - from;
    const auto at = [&](double share) { return system_.tick(from + share * way); };
    const rt::Vec3 middle = at(0.5);
    const double coarse_j = simpson_j(force_, middle, at(1), way);
    system_.restore(memory);
    const rt::Vec3 fine[4] = {at(0.25), at(0.5), at(0.75), at(1)};
    const double fine_j =
        simpson_j(force_, fine[0], fine[1], 0.5 * way) + simpson_j(fine[1], fine[2], fine[3], 0.5 * way);
    const double change_j = std::abs(fine_j - coarse_j);
    if (change_j > tolerance_j_ && halvings < kMaxHalvings) {
      system_.restore(memory);
      advance(from + 0.5 * way, halvings + 1);
      advance(to, halvings + 1);
      return;
    }
    place_ = to;
    force_ = fine[3];
    got_j_ += fine_j;
    error_j_ += change_j;
    gained_j_ = std::max(gained_j_, got_j_ - error_j_);
  }

  System& system_;
  const double tolerance_j_;
  rt::Vec3 place_;
  rt::Vec3 force_;
  double got_j_ = 0;
  double error_j_ = 0;
  double gained_j_ = -std::numeric_limits<double>::infinity();
};

}  // namespace hapticd::test
