// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "rt/loop_state.h"
#include "rt/vec3.h"
#include "tools/lib/palpation/layer_fit.h"
#include "tools/lib/palpation/stiffness_estimate.h"

namespace hapticd::tools {

/// What was found in one cell of the grid over the surface.
struct PalpatedCell {
  rt::Vec3 position_m_in_world;  ///< mean of the proxies
  std::uint64_t samples = 0;     ///< that count
  StiffnessEstimate estimate;    ///< of all depths together
  LayerFit layers;
};

/// A place that is stiffer than its surroundings.
struct Nodule {
  rt::Vec3 position_m_in_world;  ///< on the surface, above its centre
  double stiffness_n_per_m = 0;
  double surroundings_n_per_m = 0;
  double layer_m = 0;  ///< depth from which it acts; 0: from the surface
};

struct PalpationMap {
  std::vector<PalpatedCell> cells;  ///< in the order of the grid
  std::optional<Nodule> nodule;
};

/// Collects the ticks in contact with laws that have a proxy, and finds stiffness over the surface. The
/// direction from the HIP to the proxy counts as the normal, so contacts should be without friction, or
/// pressed without sliding.  Thread: one.
class Palpation {
 public:
  /// Differences in stiffness below this share cannot be told apart by hand.
  static constexpr double kLeastExcess = 0.25;

  /// Adds a tick; those without contact are ignored.
  void add(const rt::Tick& tick);
  std::uint64_t contactTicks() const { return presses_.size(); }
  /// Divides the surface into square cells with edges of `cell_m` (> 0). Cells without a stiffness that is
  /// known are left out.
  PalpationMap map(double cell_m) const;

 private:
  struct Press {
    rt::Vec3 proxy_m_in_world;
    PressSample sample;
  };
  std::vector<Press> presses_;
  rt::Vec3 sum_of_proxies_;
  rt::Vec3 sum_of_normals_;
};

/// Returns the place that stands out by at least Palpation::kLeastExcess, if there is one: the centroid of
/// the cells, weighted by how much their lower stiffness exceeds the median's.
std::optional<Nodule> findNodule(const std::vector<PalpatedCell>& cells);

}  // namespace hapticd::tools
