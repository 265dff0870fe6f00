// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "rt/vec3.h"
#include "tools/hapticbench/recordings/resting_surface.h"

namespace hapticd::tools {

/// One tick of a hand on a known surface.
struct StrokeTick {
  rt::Vec3 hip_m;
  rt::Vec3 true_force_n;  ///< of the spring to an ideal constraint; zero in front of the surface
  rt::Vec3 normal;        ///< out of the surface
  rt::Vec3 along;         ///< unit vector of the stroke; zero while it does not stroke
  bool presses = false;   ///< at full depth
};

/// The action of the hand 8 mm behind the surface.
enum class Handling : std::uint8_t { still, along_row, along_column };

/// The HIP waits 30 mm in front of the surface while the law sees its first frames, is pushed in 8 mm at
/// 0.1 m/s and strokes up to 100 mm at 0.1 m/s, no nearer to the fit's border than 25 mm, or stays there for
/// two seconds.
std::vector<StrokeTick> handleSurface(const RestingSurface& surface, const CameraDisparity& camera,
                                      Handling handling, double stiffness_n_per_m);

}  // namespace hapticd::tools
