// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "config/error.h"
#include "rt/depth_frame.h"
#include "rt/parameters.h"
#include "tools/hapticbench/pareto/contender.h"
#include "tools/hapticbench/pareto/cpu_cost.h"

namespace hapticd::tools {

/// Depth frames that are shown in a loop, and the path of a HIP that touches what they show.
struct TimedScene {
  std::string name;
  rt::DepthModelParameters camera{};
  std::vector<std::shared_ptr<const rt::DepthFrame>> frames{};
  rt::Vec3 surface_m{};
  rt::Vec3 inward{};
  std::vector<rt::Vec3> path{};  ///< of the HIP, at 1 kHz; empty: touchingPath()
  bool unrelated = false;        ///< consecutive positions of the path are unrelated
};

/// The table and the sphere of bench_scene.h, and the recordings in the folder `recordings`, if there are
/// any. Errors: a recording that cannot be read, or that shows nothing within 2 m.
config::Result<std::vector<TimedScene>> timedScenes(const std::string& recordings);

/// A plane turned by 30 degrees with the harsher noise.
TimedScene slopeAt(double distance_m);

struct CostOptions {
  double seconds = 2;  ///< of motion, where the scene has no path of its own
  int repeats = 3;     ///< runs, of which the fastest of each sample counts
  int checks = 40;     ///< positions at which forces are compared with the reference; 0: none
};

/// The times of one contender on one scene or on several.
struct ContenderCost {
  ContenderKind kind;
  CostSamples samples;
  int models = 0;                    ///< in one run
  int contacts = 0;                  ///< ticks with a force
  double largest_difference_n = -1;  ///< from the reference, paper's law only; -1: not compared
};

/// The contenders in turn, frame by frame: each models the frame and computes the forces until the next one,
/// so that disturbances fall on all of them and none profits from what another left in the caches.
std::vector<ContenderCost> measureCosts(const TimedScene& scene, const std::vector<ContenderKind>& kinds,
                                        const CostOptions& options);

/// Adds the measurements on another scene, which must have the same kinds in the same order.
void addCosts(std::vector<ContenderCost>& sum, const std::vector<ContenderCost>& more);

}  // namespace hapticd::tools
