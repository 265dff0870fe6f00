// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <type_traits>

#include "rt/base/realtime_safe.h"
#include "rt/base/vec3.h"

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

/// The faces of a solid that hold a proxy: tangent planes next to its last places, at most three, as planes
/// meet in a corner.
struct HoldingFaces {
  static constexpr std::size_t kMax = 3;

  struct Face {
    HalfSpace half_space;  ///< the free side of the tangent plane
    Vec3 foot_m;           ///< where the plane touches the solid
  };
  std::array<Face, kMax> faces;  ///< the newest first
  std::size_t count = 0;

  /// Keeps the face next to a place, and of the older ones those that go with it: where the free side is
  /// hollow, each face leaves the places of the others free. `foot_m`: of the place, whose distance from the
  /// solid is `room_m`; distances below `tolerance_m` do not count.
  void insert(const Vec3& place_m, double room_m, const Vec3& normal, const Vec3& foot_m,
              double tolerance_m) noexcept {
    const Face face{{normal, dot(normal, foot_m)}, foot_m};
    constexpr double kSameFace = 0.9999;  // 0.8 degrees
    std::array<Face, kMax> kept{face};
    std::size_t kept_count = 1;
    for (std::size_t k = 0; k < count && kept_count < kMax; ++k) {
      const Face& old = faces[k];
      const bool same = dot(old.half_space.normal, normal) > kSameFace;
      const bool leaves_free = old.half_space.room_m(place_m) >= room_m - tolerance_m &&
                               face.half_space.room_m(old.foot_m) >= -tolerance_m;
      if (!same && leaves_free) kept[kept_count++] = old;
    }
    faces = kept;
    count = kept_count;
  }

  /// Returns the place on the free side of all faces that is nearest to the HIP.
  Vec3 nearestTo(const Vec3& hip_m) const noexcept {
    std::array<HalfSpace, kMax> half_spaces;
    std::array<double, kMax> multipliers{};
    for (std::size_t k = 0; k < count; ++k) half_spaces[k] = faces[k].half_space;
    Vec3 nearest_m;
    projectOnto(std::span(half_spaces).first(count), hip_m, nearest_m, std::span(multipliers).first(count));
    return nearest_m;
  }
};
static_assert(std::is_trivially_copyable_v<HoldingFaces>);

}  // namespace hapticd::rt
