// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "tools/hapticbench/accuracy/accuracy_scene.h"
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
auto fieldsOf(Is<PopThroughs> auto& pops) {
  auto& [pushes, popped, dipped, under, least_force_n, depth_mm] = pops;
  return std::tie(pushes, popped, dipped, under, least_force_n, depth_mm);
}

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

  /// Adds the measurements on another scene.
  void add(const AccuracyRow& other);
};
auto fieldsOf(Is<AccuracyRow> auto& row) {
  auto& [scene, distance, noise, setting, error, proxy, pops, law_step, blended_step, slew, held, outside] =
      row;
  return std::tie(scene, distance, noise, setting, error, proxy, pops, law_step, blended_step, slew, held,
                  outside);
}

/// One scene as a camera sees it, which all laws are measured on.
struct AccuracyCase {
  AccuracyScene scene;
  double distance_m = 0;
  SceneNoise noise = SceneNoise::none;
};
std::vector<AccuracyCase> casesOf(const AccuracyOptions& options);

/// A row for each setting of the options.
std::vector<AccuracyRow> measureCase(const AccuracyCase& one, const AccuracyOptions& options);

/// The rows of all cases.
std::vector<AccuracyRow> measureAccuracy(const AccuracyOptions& options);

}  // namespace hapticd::tools
