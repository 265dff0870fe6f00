// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "rt/fixture.h"
#include "rt/joint_stiffness.h"
#include "rt/realtime_safe.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// A place on a path.
struct PlaceOnPath {
  Vec3 place_m_in_world;
  Vec3 tangent_in_world;  ///< direction of the path
};

/// Where a place is on its path: the element, and the arc length within it.
struct PathPosition {
  std::uint32_t element = 0;
  double along_m = 0;
};

/// What a guidance fixture keeps from one tick to the next.
struct GuidanceMemory {
  bool on_path = false;           ///< the place on the path is known
  PathPosition position;          ///< of the place on the path
  PlaceOnPath place;              ///< the same in space
  std::uint32_t search_next = 0;  ///< search for the nearest place: the next element to compare ...
  std::uint32_t search_best = 0;  ///< ... the nearest one so far ...
  double search_best_m = 0;       ///< ... and its distance
  double share = 0;               ///< of the force, 0..1: fades in and, after an escape, out
  bool escaped = false;           ///< gave way to the hand; until the hand is back
  double above_escape_s = 0;      ///< time for which the hand has pulled more than the escape force
  Vec3 force_n;                   ///< of the last tick
  double stiffness_n_per_m = 0;   ///< in effect, before the stiffness limit
  StiffnessShare stiffness_share;
};

/// Input of one tick of guidance.
struct GuidanceInput {
  const Fixture& fixture;                 ///< path or point
  std::span<const PathElement> elements;  ///< of the path
  Vec3 hip_m_in_world;
  Vec3 velocity_m_per_s;              ///< of the HIP
  Vec3 motion_m;                      ///< of the HIP since the last tick
  double most_stiffness_n_per_m = 0;  ///< guidance is weaker than contact
  double most_force_n = 0;            ///< the same for the force
  double lag_damping_s = 0;           ///< damping per stiffness that the loop's lag requires
  double period_s = 0;
};

/// Result of one tick of guidance.
struct GuidanceForce {
  Vec3 force_n;
  double stiffness_n_per_m = 0;  ///< in effect, before the stiffness limit
  double most_force_n = 0;       ///< in effect
  double stored_j = 0;           ///< energy in the spring
  bool located = false;          ///< the place on the path is known; always so for a point
  double distance_m = 0;         ///< of the HIP from path or point
  Vec3 tangent_in_world;         ///< of the path; zero for a point
};

/// Computes the force of one guidance fixture: the negative gradient of the energy of a spring from the HIP
/// to its place on the path, with a deadband and saturation, and damping across the path.
///
/// The place moves along the path towards where it is nearest to the HIP, no faster than twice the HIP, and
/// no faster than changes the spring by the HIP's displacement and 0.02 N per tick. So it passes crossings
/// straight on, does not leap from one side of a bend to the other, and takes energy out of the spring where
/// it follows: no closed path gains energy. In one tick the force changes by no more than the stiffness times
/// the HIP's displacement and 0.05 N. Where the hand pulls with more than the escape force for 50 ms, the
/// fixture fades out over 0.2 s; when the hand comes back to half of that distance, the nearest place is
/// looked up again and the fixture fades in. RT: safe.
GuidanceForce guide(const GuidanceInput& input, GuidanceMemory& memory) HAPTICD_RT;

/// Returns the place at an arc length within an element, and the direction of the path there.  RT: safe.
PlaceOnPath placeOn(const PathElement& element, double along_m) noexcept;

/// Returns the arc length within an element at which it is nearest to a place.  RT: safe.
double nearestOn(const PathElement& element, const Vec3& p_m_in_world) noexcept;

}  // namespace hapticd::rt
