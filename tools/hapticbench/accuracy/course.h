// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "rt/vec3.h"
#include "tools/hapticbench/accuracy/accuracy_scene.h"
#include "tools/truth/true_scene.h"

namespace hapticd::tools {

/// Where forces are compared with the truth.
enum class SamplePlace : std::uint8_t {
  none,
  in_front,  ///< 5 to 20 mm in front of the surface: only the spring laws push there
  behind,    ///< 5 to 20 mm behind it
};

struct CourseTick {
  rt::Vec3 hip_m;
  int frame = 0;            ///< the newest one
  bool ends_frame = false;  ///< the next tick sees a newer frame
  double depth_m = 0;       ///< of the HIP behind the visible surface of that frame, negative in front of it
  rt::Vec3 ideal_force_n;   ///< spring from the HIP to an ideal constraint
  SamplePlace sample = SamplePlace::none;
};

/// A way of the HIP and what an ideal constraint feels on it, tick by tick. It ends where the ideal force
/// along `outward` exceeds 20 N by a margin, or no longer rises (the HIP is on its way out on the other side
/// of a body).
struct Course {
  std::vector<CourseTick> ticks;
  rt::Vec3 outward;
  int first_moving_frame = 0;  ///< up to that one the scene is still
};

/// Deepest place of the HIP, more than 20 N at 500 N/m.
inline constexpr double kDeepest_m = 0.045;

/// Pushes at 0.1 m/s from 30 mm in front of the scene's approach, each at another place within 4 mm aside of
/// it. `stiffness`: of the ideal constraint, N/m.
std::vector<Course> pushes(const TrueScene& scene, double stiffness_n_per_m, int count, std::uint32_t seed);

/// The HIP stays 20 mm in front of where the plane was, and the plane comes.
Course waitForPlane(const TrueScene& scene, double stiffness_n_per_m, std::uint32_t seed);

/// The HIP is pushed to 10 mm behind the plane and stays, and then the plane comes.
Course pressThenPlane(const TrueScene& scene, double stiffness_n_per_m, std::uint32_t seed);

}  // namespace hapticd::tools
