// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/truth/fine_depth_model.h"

namespace hapticd::tools {

rt::DepthModelParameters fineDepthModel(double near_m, double far_m) {
  constexpr double kSteps = 2046;
  constexpr double kRounding = 1e-9;  // so that the first and the last raw value are not out of range
  rt::DepthModelParameters model;
  model.a_per_m = (1 / far_m - 1 / near_m) / kSteps;
  model.b_per_m = 1 / near_m;
  model.near_m = near_m * (1 - kRounding);
  model.far_m = far_m * (1 + kRounding);
  return model;
}

rt::DepthModelParameters fineDepthModelAround(double middle_m, double beyond_m) {
  const double far_m = middle_m + beyond_m;
  return fineDepthModel(1 / (2 / middle_m - 1 / far_m), far_m);
}

}  // namespace hapticd::tools
