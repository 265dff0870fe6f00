// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "rt/parameters.h"

namespace hapticd::tools {

/// The values that the paper's authors chose from by feel, or fewer.
struct SweepGrid {
  std::vector<int> max_points{50, 100, 150, 200, 250, 300};
  std::vector<double> stiffnesses_n_per_m{300, 400, 500, 600, 700};
  std::vector<double> radii_m{0.02, 0.03, 0.04, 0.05, 0.06, 0.07};

  static SweepGrid quick() { return {{50, 100, 300}, {300, 500, 700}, {0.02, 0.04, 0.07}}; }
};

/// One law with one set of parameters. What a law does not read stays at the paper's value.
struct SweepPoint {
  std::size_t index = 0;  ///< in the whole grid
  rt::ForceLaw law = rt::ForceLaw::nearest_springs;
  rt::SpringParameters springs;

  bool usesMaxPoints() const { return law == rt::ForceLaw::nearest_springs; }
  bool usesRadius() const {
    return law == rt::ForceLaw::nearest_springs || law == rt::ForceLaw::smooth_springs;
  }
  /// The paper's law with the set that the paper chose: (500 N/m, 0.04 m, 10, 100).
  bool isPapers() const;
};

/// Every point once, in an order that depends on `grid` only: nearest_springs over all three axes,
/// smooth_springs over k_s and D_thresh (it has no N_max), proxy and surface over k_s (D_thresh has no part
/// in their force).
std::vector<SweepPoint> pointsOf(const SweepGrid& grid);

}  // namespace hapticd::tools
