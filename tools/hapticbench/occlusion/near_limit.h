// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "config/settings.h"
#include "rt/loop_state.h"

namespace hapticd::tools {

/// What happened to the force on a HIP when the surface that it presses on came nearer than the camera
/// measures.
struct NearLimitResult {
  double force_n = 0;         ///< at the last tick before the surface was too near
  double held_ms = 0;         ///< from then on until the force was below half of that
  double least_held_n = 0;    ///< the smallest force in that time, the ramp of the release included
  double released_ms = 0;     ///< until it was below 5 % of it; negative: it never was
  double largest_step_n = 0;  ///< of the command from one tick to the next, from then on
  bool cause_named = false;   ///< the cause surface_too_near stood in a tick from then on
  bool came_back = false;     ///< the force was there again when the surface was

  static NearLimitResult none() { return {.released_ms = -1}; }
};

/// One tick of it: the command along the surface's normal, and the cause.
struct NearLimitTick {
  double outward_n = 0;
  rt::Cause cause = rt::Cause::none;
};

/// `too_near`: the tick from which on the surface is not measured; `back`: from which on it is again.
NearLimitResult judgeNearLimit(const std::vector<NearLimitTick>& ticks, std::size_t too_near,
                               std::size_t back);

/// A wall comes at that speed, passes the HIP, which ends 6 mm behind it at the camera's near limit, goes on
/// 30 mm, waits for two seconds and goes back.
NearLimitResult runNearLimit(config::LawChoice law, double speed_m_per_s);

}  // namespace hapticd::tools
