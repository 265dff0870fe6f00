// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "rt/parameters.h"
#include "rt/vec3.h"
#include "tools/truth/true_scene.h"

/// What the two spring laws give on a surface without noise, in double precision: in closed form above a
/// fronto-parallel plane (Nm: k in N/m, lengths in metres, along the outward normal, odd in the height), and
/// by the sum over exact points elsewhere.
namespace hapticd::tools {

/// Radius of the disc that holds the `max_points` nearest pixels of a fronto-parallel plane at `depth_m`.
double nearestDiscRadius_m(const rt::DepthModelParameters& camera, double depth_m, int max_points);

/// Mean over the nearest points within a disc of that radius, or over all points within D where fewer fit.
double nearestSpringsAbovePlane_n(const rt::SpringParameters& springs, double disc_radius_m, double height_m);

/// The largest value of the above over the height: the pop-through force.
double popThroughForce_n(const rt::SpringParameters& springs, double disc_radius_m);

/// Weights 1 - s/D, all points within D.
double smoothSpringsAbovePlane_n(const rt::SpringParameters& springs, double height_m);

/// The exact points of the pixels that the camera sees within `radius_m` of `centre`.
std::vector<rt::Vec3> exactPoints_m(const TrueScene& scene, const rt::Vec3& centre_m, double radius_m,
                                    double t_s);

/// Eq. (6)-(11) over `points`.
rt::Vec3 nearestSpringsOver_n(const std::vector<rt::Vec3>& points_m, const rt::Vec3& hip_m,
                              const rt::SpringParameters& springs);

/// Mean of the same springs with weights 1 - s/D over all points within D; zero below `min_points`.
rt::Vec3 smoothSpringsOver_n(const std::vector<rt::Vec3>& points_m, const rt::Vec3& hip_m,
                             const rt::SpringParameters& springs);

}  // namespace hapticd::tools
