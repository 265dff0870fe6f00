// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include "rt/realtime_safe.h"
#include "rt/vec3.h"

/// The point nearest to a given one among those that satisfy several linear constraints.
namespace hapticd::rt {

/// The places with dot(normal, place) >= offset_m. `normal`: unit vector.
struct HalfSpace {
  Vec3 normal;
  double offset_m = 0;

  /// Returns how far a place is inside the allowed side; negative: outside.
  double room_m(const Vec3& place_m) const noexcept { return dot(normal, place_m) - offset_m; }
};

/// Returns the point of the intersection of `half_spaces` that is nearest to `from_m`, and in `multipliers_m`
/// (one for each half-space, >= 0) how the displacement is composed: place = from + sum of multiplier times
/// normal. Dual active-set method of Goldfarb and Idnani 1983 with the identity as Hessian, so that never
/// more than three constraints are active; deterministic, bounded effort. If no place satisfies all,
/// `place_m` is `from_m` and each multiplier is the depth of `from_m` outside its own half-space. Returns
/// whether there is such a place.  RT: safe.
bool projectOnto(std::span<const HalfSpace> half_spaces, const Vec3& from_m, Vec3& place_m,
                 std::span<double> multipliers_m) HAPTICD_RT;

}  // namespace hapticd::rt
