// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "rt/parameters.h"
#include "tools/hapticbench/strokes/stroke_case.h"
#include "tools/hapticbench/strokes/stroke_ticks.h"
#include "tools/truth/body_scene.h"

namespace hapticd::tools {

/// How a camera sees a case.
struct StrokeView {
  SceneNoise noise = SceneNoise::none;
  rt::DepthModelParameters camera;
  double latency_s = 0;  ///< from what a frame shows to its arrival
  std::uint32_t seed = 1;
};

/// One stroke as every law felt it.
struct StrokeRun {
  std::vector<TrueTick> truth;
  std::vector<std::vector<FeltTick>> felt;  ///< by the settings in turn
  double pitch_m = 0;                       ///< of the pixels along the stroke, at its end
};

/// The stroke at 1000 ticks and 30 frames per second; all settings see the same frames.
/// `settings`: whole live sets, whose limits on the force do not act here.
StrokeRun runStroke(const StrokeCase& stroke, const StrokeView& view,
                    const std::vector<rt::LiveParameters>& settings);

}  // namespace hapticd::tools
