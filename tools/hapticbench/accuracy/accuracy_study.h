// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "config/law_choice.h"
#include "rt/force_law.h"
#include "rt/parameters.h"
#include "tools/hapticbench/accuracy/force_error.h"
#include "tools/truth/true_scene.h"

namespace hapticd::tools {

inline constexpr std::array<rt::ForceLaw, 4> kAllLaws{
    rt::ForceLaw::nearest_springs, rt::ForceLaw::smooth_springs, rt::ForceLaw::proxy, rt::ForceLaw::surface};
using config::nameOf;
std::string_view nameOf(SceneNoise noise);

/// "On": what a user of a real sensor sets.
inline constexpr rt::FilterParameters kFilterOn = config::filterOfChoice();

/// The edge of the grid of points that the laws are measured with.
inline constexpr double kUsualVoxelEdge_m = 0.01;

struct AccuracyOptions {
  std::vector<std::string> scenes;  ///< names of accuracyScenes()
  std::vector<rt::ForceLaw> laws{kAllLaws.begin(), kAllLaws.end()};
  std::vector<double> distances_m{0.6, 1, 2};
  std::vector<SceneNoise> noises{SceneNoise::none, SceneNoise::harsh};
  /// Of the grid of points, each of which must give the same forces as kUsualVoxelEdge_m.
  std::vector<double> voxel_edges_m;
  std::vector<bool> filters{false, true};  ///< of the laws on points; `surface` has none
  int pushes = 3;                          ///< per case, each at another place
  int hold_frames = 60;                    ///< that a still HIP is held over
  std::uint32_t seed = 1;                  ///< of the places and of the noise
};

/// Limits below which a surface must not give way, N.
inline constexpr std::array<double, 3> kPopLimits_n{3, 10, 20};

/// What the pushes of a case came to.
struct PopThroughs {
  int pushes = 0;
  int popped = 0;
  int around = 0;  ///< of those under the last limit: the proxy slid off the border and around
  int dipped = 0;  ///< fell as if it gave way and recovered; see PopThrough
  std::array<int, kPopLimits_n.size()> popped_under{};  ///< of kPopLimits_n
  double least_force_n = 0;                             ///< the smallest of the largest forces
  double depth_at_least_force_mm =
      0;  ///< the HIP's penetration at that force, negative in front of the surface

  void add(const PopThroughs& other);
};

/// One law on one scene in one setting.
struct AccuracyRow {
  std::string scene;
  double distance_m = 0;
  SceneNoise noise = SceneNoise::none;
  rt::ForceLaw law = rt::ForceLaw::nearest_springs;
  double voxel_edge_m = kUsualVoxelEdge_m;  ///< of the grid of points
  bool filtered = false;

  ForceErrors against_surface;  ///< the true one, by an ideal constraint of k_s; 5 to 20 mm behind it
  ForceErrors against_law;      ///< in double precision (law_truth.h); nothing for `surface`
  Spread proxy_to_surface_mm;   ///< the proxy's distance from the true surface; laws with a proxy
  PopThroughs pops;
  double largest_drop_n =
      0;  ///< moving scenes: how far the force fell behind an earlier one while the scene came
  double law_step_n = 0;      ///< largest |F(after) - F(before)| of the law at a frame change, HIP held still
  double blended_step_n = 0;  ///< the same of the commanded force, in the tick of the change
  double slew_n_per_s = 0;    ///< largest |dF|/dt of the commanded force at any tick
  bool held = false;          ///< the three above were measured
  int outside_model = 0;      ///< ticks whose force lacked a part of the scene
  double grid_difference_n = -1;  ///< laws on points: largest difference of the force from that with voxels
                                  ///< of kUsualVoxelEdge_m; -1: not measured
};

/// Measures every combination that the options name. Calls `progress`, if there is one, before each scene and
/// distance.
std::vector<AccuracyRow> measureAccuracy(const AccuracyOptions& options,
                                         const std::function<void(const std::string&)>& progress = {});

}  // namespace hapticd::tools
