// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "rt/vec3.h"
#include "tools/lib/truth/true_scene.h"

namespace hapticd::tools {

struct CourseTick {
  rt::Vec3 hip_m{};
  int frame = 0;             ///< the newest one
  double depth_m = 0;        ///< of the HIP behind the visible surface, negative in front of it
  rt::Vec3 ideal_force_n{};  ///< spring from the HIP to an ideal constraint
  bool is_sample = false;    ///< forces are compared with the ideal one: 5 to 20 mm behind the surface
};

/// The motion of the HIP and the force of an ideal constraint on it, tick by tick. It ends where the ideal
/// force along `outward` exceeds 20 N by a margin, or no longer rises (the HIP is about to leave the body on
/// its far side).
struct Course {
  std::vector<CourseTick> ticks;
  rt::Vec3 outward;
};

/// Largest penetration of the HIP, more than 20 N at 500 N/m.
inline constexpr double kDeepest_m = 0.045;

/// Pushes at 0.1 m/s from 30 mm in front of the scene's approach, each at another position within 4 mm of it.
/// `stiffness`: of the ideal constraint, N/m.
std::vector<Course> pushes(const TrueScene& scene, double stiffness_n_per_m, int count, std::uint32_t seed);

}  // namespace hapticd::tools
