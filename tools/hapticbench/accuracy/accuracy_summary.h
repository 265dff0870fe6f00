// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tools/hapticbench/accuracy/accuracy_study.h"

namespace hapticd::tools {

/// All scenes and distances of one law in one setting and noise together.
struct AccuracySummary {
  rt::ForceLaw law = rt::ForceLaw::nearest_springs;
  SceneNoise noise = SceneNoise::none;
  bool filtered = false;
  ForceErrors against_surface;
  ForceErrors against_law;
  Spread proxy_to_surface_mm;
  PopThroughs pops;
  double largest_drop_n = 0;
  double law_step_n = 0;
  double blended_step_n = 0;
  double slew_n_per_s = 0;
  int outside_model = 0;
};
std::vector<AccuracySummary> summaryOf(const std::vector<AccuracyRow>& rows);

/// Something that the laws must keep, and whether the rows show that they do.
struct Requirement {
  std::string text;
  std::size_t rows = 0;                 ///< that it was checked on; 0: not measured
  std::vector<std::string> violations;  ///< one line each, with the figures
};
std::vector<Requirement> requirementsOf(const std::vector<AccuracyRow>& rows);

}  // namespace hapticd::tools
