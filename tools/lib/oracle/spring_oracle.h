// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "rt/base/parameters.h"
#include "rt/base/vec3.h"

namespace hapticd::tools {

/// The paper's law, eq. (6)-(11), at one HIP: every distance, a full sort, double precision. Shares no code
/// with the core but the plain data types. Thread: any.  RT: not safe (allocates).
class SpringOracle {
 public:
  /// Points whose distances differ by less are interchangeable where a tolerance of micrometres will do.
  static constexpr double kTie_m = 1e-6;

  /// `points_m`: all points of the frame in image order, in the frame of `hip_m`; of equally far ones the
  /// first are chosen.
  SpringOracle(std::span<const rt::Vec3> points_m, const rt::Vec3& hip_m,
               const rt::SpringParameters& springs);

  /// Returns F_HIP in newtons. A point within 1e-9 m of the HIP, where eq. (10) is undefined, counts without
  /// force.
  const rt::Vec3& force_n() const noexcept { return force_n_; }
  /// Returns N of eq. (11); 0 below N_min points.
  std::uint32_t pointsUsed() const noexcept { return points_used_; }

  /// Returns the difference in metres between D_thresh and the distance closest to it: what decides which
  /// points are within D_thresh. Infinite where no point is within 0.005 % of D_thresh or nearer.
  double radiusMargin_m() const noexcept { return radius_margin_m_; }
  /// Returns how much farther the nearest point left out is than the farthest point chosen, in metres: what
  /// decides which points are the N_max nearest. Infinite where all points within D_thresh are used.
  double rankMargin_m() const noexcept { return rank_margin_m_; }

  /// Returns the smallest distance in newtons of `force_n` to a correct result. There are several where
  /// points are within `tie_m` of the distance of the N_max-th: each choice among those is correct. Throws
  /// std::runtime_error where there are more than 20000 choices.
  double error_n(const rt::Vec3& force_n, double tie_m = kTie_m) const;

 private:
  struct Neighbour {
    double distance_m;
    rt::Vec3 spring_n;  // F_k of eq. (10)
  };

  static Neighbour neighbourAt(const rt::Vec3& point_m, const rt::Vec3& hip_m, double distance_m,
                               const rt::SpringParameters& springs);
  static rt::Vec3 sumOf(std::span<const Neighbour> neighbours);

  std::vector<Neighbour> near_;  // within D_thresh, nearest first
  rt::Vec3 force_n_;
  std::uint32_t points_used_ = 0;
  double radius_margin_m_ = std::numeric_limits<double>::infinity();
  double rank_margin_m_ = std::numeric_limits<double>::infinity();
};

}  // namespace hapticd::tools
