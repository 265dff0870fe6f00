// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "tools/lib/palpation/stiffness_estimate.h"

namespace hapticd::tools {

/// Stiffness above and below a depth, which are equal where no layer is found.
struct LayerFit {
  bool known = false;
  bool layered = false;
  double upper_n_per_m = 0;
  double lower_n_per_m = 0;
  double layer_m = 0;  ///< depth of the boundary; 0: none
};

/// Fits F = K1 min(d, t) + K2 max(d - t, 0) + B d' by least squares to the samples that count, for the
/// boundary t that leaves least. A boundary is taken for real if the two stiffnesses differ by a tenth and it
/// explains half of what one layer leaves.
LayerFit fitLayers(const std::vector<PressSample>& samples);

}  // namespace hapticd::tools
