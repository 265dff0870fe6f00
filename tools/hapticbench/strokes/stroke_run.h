// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rt/force_law.h"
#include "rt/parameters.h"
#include "tools/hapticbench/strokes/stroke_case.h"
#include "tools/lib/truth/body_scene.h"
#include "tools/lib/truth/true_body.h"

namespace hapticd::tools {

/// The truth at the time of a tick. World frame, metres, newtons.
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

/// The output of a law at the same tick. World frame, metres, newtons.
struct LawTick {
  rt::Vec3 law_force_n;
  rt::Vec3 blended_force_n;  ///< what the hand gets where no limit acts
  rt::Vec3 proxy_m;
  rt::ContactState state = rt::ContactState::free;
  bool outside_model = false;
};

/// The properties of the camera that sees a case.
struct StrokeView {
  SceneNoise noise = SceneNoise::none;
  rt::DepthModelParameters camera;
  double latency_s = 0;  ///< from what a frame shows to its arrival
  std::uint32_t seed = 1;
};

/// One stroke, and the forces of every law on it.
struct StrokeRun {
  std::vector<TrueTick> truth;
  std::vector<std::vector<LawTick>> output;  ///< by the settings in turn
  double pitch_m = 0;                        ///< of the pixels along the stroke, at its end
};

/// The stroke at 1000 ticks and 30 frames per second; all settings see the same frames.
/// `settings`: complete parameters; their limits on the force are lifted.
StrokeRun runStroke(const StrokeCase& stroke, const StrokeView& view,
                    const std::vector<rt::LiveParameters>& settings);

}  // namespace hapticd::tools
