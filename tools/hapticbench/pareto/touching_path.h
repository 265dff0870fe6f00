// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "rt/vec3.h"

namespace hapticd::tools {

/// The highest speed of touchingPath(), m/s.
inline constexpr double kPathSpeed_m_per_s = 0.5;
inline constexpr double kPathRadius_m = 0.06;

/// A HIP that moves at 1 kHz around a point on a surface: in a circle and in and out, from 35 mm in
/// front of the surface to 15 mm behind it. Not faster than kPathSpeed_m_per_s, times `speed_up`. `inward`:
/// unit vector. `radius_m`: of the circle, at most kPathRadius_m.
std::vector<rt::Vec3> touchingPath(const rt::Vec3& surface_m, const rt::Vec3& inward, int ticks,
                                   double radius_m = kPathRadius_m, double speed_up = 1);

}  // namespace hapticd::tools
