// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "rt/parameters.h"
#include "rt/vec3.h"
#include "tools/hapticbench/accuracy/accuracy_scene.h"
#include "tools/hapticbench/accuracy/course.h"

/// What a law itself says at the samples of a course, in double precision: the measure of its implementation.
namespace hapticd::tools {

/// The spring law that `parameters` name, on the surface without noise: the closed form above planes that
/// face the camera, elsewhere the sum over the exact points of all pixels. One force per sample of the
/// course, newtons.
std::vector<rt::Vec3> springTruth_n(const TrueScene& scene, const Course& course,
                                    const rt::LiveParameters& parameters);

/// The constraint laws on the frame's own surface: the spring from the HIP to the closest point of the
/// disparities as they are after the filter of `parameters`, interpolated between pixels. Zero where the HIP
/// is in front of that surface. `first_frame`: the first that the filter sees.
std::vector<rt::Vec3> constraintTruth_n(const TrueScene& scene, const Course& course, FrameReel& reel,
                                        int first_frame, const rt::LiveParameters& parameters);

}  // namespace hapticd::tools
