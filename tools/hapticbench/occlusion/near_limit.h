// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "rt/loop_state.h"

namespace hapticd::tools {

/// The force on a HIP while the surface that it presses on comes nearer than the camera measures.
struct NearLimitResult {
  double force_n = 0;         ///< at the last tick before the surface was too near
  double held_ms = 0;         ///< from then on until the force was below half of that
  double least_held_n = 0;    ///< the smallest force in that time, the ramp of the release included
  double released_ms = 0;     ///< until it was below 5 % of it; negative: it never was
  double largest_step_n = 0;  ///< of the command from one tick to the next, from then on
  bool cause_named = false;   ///< the cause surface_too_near was in a tick from then on
  bool came_back = false;     ///< the force returned with the surface

  static NearLimitResult none() { return {.released_ms = -1}; }
};

/// One tick of such a run: the command along the normal of the surface, and the cause.
struct NearLimitTick {
  double outward_n = 0;
  rt::Cause cause = rt::Cause::none;
};

/// `too_near`: the first tick at which the surface is not measured; `back`: the first at which it is again.
NearLimitResult judgeNearLimit(const std::vector<NearLimitTick>& ticks, std::size_t too_near,
                               std::size_t back);

/// A wall approaches at that speed and passes the HIP, which is 6 mm behind it when it reaches the near limit
/// of the camera; it goes on for 30 mm, waits for two seconds and goes back.
NearLimitResult runNearLimit(const std::string& law, double speed_m_per_s);

}  // namespace hapticd::tools
