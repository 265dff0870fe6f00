// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tools/hapticbench/accuracy/force_error.h"
#include "tools/hapticbench/pareto/cost_study.h"
#include "tools/hapticbench/pareto/distance_error.h"
#include "tools/hapticbench/pareto/laws_table.h"
#include "tools/hapticbench/requirement.h"

namespace hapticd::tools {

/// A law or a library: its cost and its error.
struct ParetoPoint {
  ContenderCost run;  ///< over all scenes
  CpuCost cost;
  ForceErrors error;  ///< against the true surface; the libraries compute the paper's law and have its error

  /// RMS error over the stiffness: the displacement of an ideal constraint that would cause it.
  double error_mm() const { return 1000 * error.error_n.rms() / rt::SpringParameters{}.stiffness_n_per_m; }
};

/// Median times in microseconds of a single force and of nanoflann's search for the 100 nearest points.
struct EvaluationRow {
  std::string scene;
  bool along_path = false;  ///< else each at an unrelated position
  double nanoflann_us = 0;
  double nearest_springs_us = 0;
  double surface_us = 0;
};

/// The most expensive force and frame of a law on a hard frame, microseconds.
struct HardFrameRow {
  std::string frame;
  std::string law;
  double force_max_us = 0;
  double model_max_us = 0;
};

/// shippedSettings(), and `surface` without its mean over frames.
std::vector<LawSetting> allSettings();

struct ParetoOptions {
  std::string recordings;
  std::vector<LawSetting> settings = allSettings();
  CostOptions cost;
  LawsTableOptions laws;
  DistanceErrorOptions distances;
  int evaluations = 1000;  ///< single forces, per scene and motion; 0: none
  int pushes = 3;          ///< per scene that the errors are of
  bool hard_frames = true;
};

struct ParetoResult {
  std::vector<std::string> scenes;  ///< that were timed
  std::vector<ParetoPoint> points;
  std::vector<LawAtDistance> laws;
  std::vector<DistanceError> distance_errors;
  std::vector<SensorLimit> sensor_limits;  ///< at the distances and with the noises of `distance_errors`
  std::vector<EvaluationRow> evaluations;
  std::vector<HardFrameRow> hard_frames;
};

/// Errors: a recording that cannot be read.
config::Result<ParetoResult> measurePareto(const ParetoOptions& options,
                                           const std::function<void(const std::string&)>& progress = {});

/// The requirements on the figures that `result` has.
std::vector<Requirement> requirementsOf(const ParetoResult& result);

}  // namespace hapticd::tools
