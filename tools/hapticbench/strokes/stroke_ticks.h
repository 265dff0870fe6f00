// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "rt/force_law.h"
#include "rt/vec3.h"
#include "tools/truth/true_body.h"

/// A stroke tick by tick: what is true and what a law made of it. World frame, metres, newtons.
namespace hapticd::tools {

/// What is true at a tick, at the tick's own time.
struct TrueTick {
  double t_s = 0;
  rt::Vec3 hip_m;
  rt::Vec3 along;                    ///< unit vector of the stroke; zero while the HIP is not stroking
  std::optional<Hold> hold;          ///< of the ideal constraint
  rt::Vec3 force_n;                  ///< of the spring from the HIP to the ideal proxy
  double clearance_m = 0;            ///< of a HIP in free space to the nearest body
  std::optional<double> past_end_m;  ///< how far the stroke is beyond where the body ends, negative before
  bool judged = false;               ///< the HIP is pressed in and the motion is steady
};

/// What a law computed at the same tick.
struct FeltTick {
  rt::Vec3 law_force_n;
  rt::Vec3 blended_force_n;  ///< what the hand gets where no limit acts
  rt::Vec3 proxy_m;
  rt::ContactState state = rt::ContactState::free;
  bool outside_model = false;
};

}  // namespace hapticd::tools
