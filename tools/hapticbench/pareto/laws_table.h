// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tools/hapticbench/accuracy/force_error.h"
#include "tools/hapticbench/law_setting.h"
#include "tools/hapticbench/pareto/cpu_cost.h"

namespace hapticd::tools {

/// A setting at one distance from the camera.
struct LawAtDistance {
  LawSetting setting;
  double distance_m = 0;
  double error_m = 0;  ///< RMS error of the force over the stiffness
  CpuCost cost;
};

inline constexpr double kTableDistances_m[] = {0.6, 0.8, 1, 1.5, 2, 3, 3.5};
/// The distances whose costs are reported and limited.
inline constexpr double kCostDistances_m[] = {0.6, 1, 2};

/// The rows as lines of a C++ initialiser list (config/measured_laws.inc), sorted, under a comment that names
/// `command`.
std::string lawsTable(std::vector<LawAtDistance> rows, const std::string& command);

/// Errors of the force against the true surface, 5 to 20 mm behind it, on a plane, a sphere and a plane
/// turned by 30 degrees together, with the harsher noise. `pushes`: per scene.
std::map<LawSetting, ForceErrors> errorsOf(const std::vector<LawSetting>& settings, double distance_m,
                                           int pushes);

struct LawsTableOptions {
  std::vector<double> distances_m{std::begin(kTableDistances_m), std::end(kTableDistances_m)};
  double seconds = 2;  ///< of motion, per distance
  int repeats = 5;
  int pushes = 3;  ///< per scene and distance
};

/// Measures shippedSettings(): errorsOf(), and times on a plane turned by 30 degrees.
std::vector<LawAtDistance> measureLaws(const LawsTableOptions& options,
                                       const std::function<void(const std::string&)>& progress = {});

}  // namespace hapticd::tools
