// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rt/parameters.h"
#include "tools/hapticbench/law_setting.h"
#include "tools/hapticbench/strokes/stroke_case.h"
#include "tools/hapticbench/strokes/stroke_judge.h"
#include "tools/hapticbench/strokes/stroke_run.h"

namespace hapticd::tools {

/// Options of the study.
struct StrokesOptions {
  std::vector<std::string> laws = kProxyLawChoices;  ///< of kLawChoices
  std::vector<std::string> scenes;                   ///< empty: all
  std::vector<double> distances_m{0.6, 1, 2};
  std::vector<SceneNoise> noises{SceneNoise::none, SceneNoise::sensor, SceneNoise::harsh};
  double depth_m = 0.008;
  double latency_ms = 0;  ///< of the camera, which `camera.latency_s` is set to
  int repeats = 1;        ///< of every variant of a scene, each at another position with other noise
  int variants = 0;       ///< at most that many of a scene; 0: all
  std::uint32_t seed = 1;
  bool each = false;  ///< one row per variant of a scene
};

/// The strokes of one scene at one distance with one noise and one law.
struct StrokesRow {
  std::string law;
  StrokeScene scene;
  std::string variant;  ///< empty: all together
  double distance_m = 0;
  SceneNoise noise = SceneNoise::none;
  StrokeFigures figures;
  double lag_limit_m = 0;
  Spread floor_n;       ///< of the error that the noise makes unavoidable; nothing where there is none
  Spread tilt_floor_n;  ///< the same of the force along the surface

  /// RMS error over the floor; nothing without noise.
  std::optional<double> errorByFloor() const;
  std::optional<double> alongByFloor() const;
};

/// `progress` is given what is measured next.
std::vector<StrokesRow> measureStrokes(const StrokesOptions& options,
                                       const std::function<void(const std::string&)>& progress);

}  // namespace hapticd::tools
