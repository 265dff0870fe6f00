// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tools/hapticbench/bench_scene.h"
#include "tools/hapticbench/statistics.h"

namespace hapticd::tools {

struct SpeedOptions {
  std::size_t positions = 1000;
  std::size_t frames = 30;      ///< whole frames modelled, per scene
  std::size_t tree_builds = 5;  ///< trees built, per scene
  std::uint32_t seed = 1;
};

/// One way to do a thing: how long it took and, for forces, how far it was from the reference.
struct Measurement {
  std::string what;
  Durations time;
  double slower_than_nanoflann = 0;   ///< median / nanoflann's median for the same task
  double largest_force_error_n = -1;  ///< -1: computes no force
};

struct SceneSpeed {
  std::string scene;
  std::size_t points = 0;     ///< valid pixels
  std::size_t ambiguous = 0;  ///< positions left out of the errors: the N_max-th point is not unique
  double reach_points = 0;    ///< mean over the positions
  std::vector<Measurement> modelling;
  std::vector<Measurement> scattered;  ///< evaluations, each far from the one before
  std::vector<Measurement> path;       ///< evaluations 0.3 mm apart, as at 0.3 m/s and 1 kHz
};

/// Measures one scene with the paper's parameters.
SceneSpeed measureSpeed(const BenchScene& scene, const SpeedOptions& options);

}  // namespace hapticd::tools
