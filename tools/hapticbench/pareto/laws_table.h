#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tools/hapticbench/pareto/law_setting.h"

namespace hapticd::tools {

/// A setting at one distance from the camera.
struct LawAtDistance {
  LawSetting setting;
  double distance_m = 0;
  double error_m = 0;  ///< RMS error of the force over the stiffness
  double cpu_ms_per_s = 0;
};

/// What config/measured_laws.inc has room for: the springs unfiltered, the constraints filtered or not, the
/// law `surface` with three voxel edges.
std::vector<LawSetting> tableSettings();
inline constexpr double kTableDistances_m[] = {0.6, 0.8, 1, 2, 3.5};

/// The rows as lines of a C++ initialiser list, sorted, under a comment that names `command`.
std::string lawsTable(std::vector<LawAtDistance> rows, const std::string& command);

struct LawsTableOptions {
  std::vector<double> distances_m{std::begin(kTableDistances_m), std::end(kTableDistances_m)};
  double seconds = 2;  ///< of motion, per distance
  int repeats = 5;
  int pushes = 3;  ///< per scene and distance
};

/// Measures what the table needs: errors on a plane, a sphere and a plane turned by 30 degrees, with sensor
/// noise, 5 to 20 mm behind the surface; times on the latter.
std::vector<LawAtDistance> measureLaws(const LawsTableOptions& options,
                                       const std::function<void(const std::string&)>& progress = {});

}  // namespace hapticd::tools
