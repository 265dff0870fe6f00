// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tools/hapticbench/accuracy/force_error.h"
#include "tools/hapticbench/law_setting.h"
#include "tools/lib/truth/scene_noise.h"

namespace hapticd::tools {

struct AccuracyOptions {
  std::vector<std::string> scenes;  ///< names of accuracyScenes(); empty: all
  std::vector<LawSetting> settings = shippedSettings();
  std::vector<double> distances_m{0.6, 1, 2};
  std::vector<SceneNoise> noises{SceneNoise::none, SceneNoise::harsh};
  int pushes = 3;          ///< per case, each at another position
  int hold_frames = 60;    ///< during which the HIP is held still; 0: no steps are measured
  std::uint32_t seed = 1;  ///< of the positions and of the noise
};

/// Limits below which a surface must not give way, N.
inline constexpr std::array<double, 3> kPopLimits_n{3, 10, 20};

/// The outcome of the pushes of a case.
struct PopThroughs {
  int pushes = 0;
  int popped = 0;
  int dipped = 0;  ///< fell as if it gave way and recovered; see PopThrough
  std::array<int, kPopLimits_n.size()> popped_under{};  ///< of kPopLimits_n
  double least_force_n = 0;                             ///< the smallest of the largest forces
  double depth_at_least_force_mm = 0;  ///< penetration at that force, negative in front of the surface

  void add(const PopThroughs& other);
};

/// One law and setting on one scene.
struct AccuracyRow {
  std::string scene;
  double distance_m = 0;
  SceneNoise noise = SceneNoise::none;
  LawSetting setting{};

  ForceErrors error{};           ///< against an ideal constraint on the true surface, 5 to 20 mm behind it
  Spread proxy_to_surface_mm{};  ///< distance of the proxy from the true surface; laws with a proxy
  PopThroughs pops{};
  double law_step_n = 0;      ///< largest change of the law's force at a new frame, HIP held still
  double blended_step_n = 0;  ///< the same of the commanded force, in the tick of the new frame
  double slew_n_per_s = 0;    ///< largest |dF/dt| of the commanded force at any tick
  bool held = false;          ///< the three above were measured
  int outside_model = 0;      ///< ticks whose force lacked a part of the scene

  /// Adds what was measured on another scene.
  void add(const AccuracyRow& other);
};

/// Measures every combination that the options name. Calls `progress`, if there is one, before each scene and
/// distance.
std::vector<AccuracyRow> measureAccuracy(const AccuracyOptions& options,
                                         const std::function<void(const std::string&)>& progress = {});

}  // namespace hapticd::tools
