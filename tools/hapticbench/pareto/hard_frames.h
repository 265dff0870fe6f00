// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "tools/hapticbench/pareto/cost_study.h"

namespace hapticd::tools {

/// Frames that are expensive to model or to search: all pixels in one ball (through a lens of 20000 pixels of
/// focal length), a wall at 0.42 m, a checkerboard and columns of two depths, and random raw values. The HIP
/// moves around what they show for a while and then jumps randomly.
std::vector<TimedScene> hardFrames();

/// The scene with a HIP that jumps between positions near what is measured, `ticks` times.
TimedScene scattered(TimedScene scene, int ticks);

/// The scene with a HIP at up to 1 m/s.
TimedScene fast(TimedScene scene, int ticks);

}  // namespace hapticd::tools
