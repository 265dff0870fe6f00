// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/sweep/sweep_grid.h"

namespace hapticd::tools {

bool SweepPoint::isPapers() const {
  const rt::SpringParameters papers;
  return law == rt::ForceLaw::nearest_springs && springs.stiffness_n_per_m == papers.stiffness_n_per_m &&
         springs.radius_m == papers.radius_m && springs.min_points == papers.min_points &&
         springs.max_points == papers.max_points;
}

std::vector<SweepPoint> pointsOf(const SweepGrid& grid) {
  std::vector<SweepPoint> points;
  const auto add = [&points](rt::ForceLaw law, const rt::SpringParameters& springs) {
    points.push_back({points.size(), law, springs});
  };
  for (const double stiffness : grid.stiffnesses_n_per_m) {
    rt::SpringParameters springs{.stiffness_n_per_m = stiffness};
    add(rt::ForceLaw::proxy, springs);
    add(rt::ForceLaw::surface, springs);
    for (const double radius : grid.radii_m) {
      springs.radius_m = radius;
      add(rt::ForceLaw::smooth_springs, springs);
      for (const int count : grid.max_points) {
        springs.max_points = count;
        add(rt::ForceLaw::nearest_springs, springs);
      }
      springs.max_points = rt::SpringParameters{}.max_points;
    }
  }
  return points;
}

}  // namespace hapticd::tools
