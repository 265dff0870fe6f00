// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/base/realtime_safe.h"
#include "rt/laws/force_law.h"
#include "rt/laws/nearest_springs.h"

namespace hapticd::rt {

/// Computes the springs of the paper's law over all points within D_thresh, each weighted with w = 1 - s /
/// D_thresh: F = sum(w f) / max(sum(w), N_min / 3), where N_min / 3 is the sum of weights of N_min points
/// spread evenly over a disc of that radius. A point enters and leaves with weight zero, and few points give
/// a weak force rather than none, so the force is continuous in the position and in the points; within 1 mm
/// of a point its direction fades in from zero. N_max is not used. Points and forces are exact (double
/// precision).
/// `input.scene` must cover the ball of radius D_thresh around the HIP.
/// RT: safe.  Cost: bounded by the points in the ball.
ForceSample smoothSprings(const LawInput& input, SearchMemory& memory) HAPTICD_RT;

}  // namespace hapticd::rt
