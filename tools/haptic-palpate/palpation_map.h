// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rt/base/vec3.h"
#include "rt/loop/loop_state.h"

namespace hapticd::tools {

/// One moment of a contact.
struct PressSample {
  double depth_m = 0;
  double rate_m_per_s = 0;  ///< of the depth
  double force_n = 0;       ///< along the normal
};

/// Stiffness and damping with their standard errors, from the variance of what the fit leaves.
struct StiffnessEstimate {
  double stiffness_n_per_m = 0;
  double damping_n_s_per_m = 0;
  double stiffness_error_n_per_m = 0;
  double damping_error_n_s_per_m = 0;
  bool known = false;  ///< there were enough samples, at different depths and rates
};

/// Recursive least squares of K and B in F = K d + B d', with exponential forgetting, in the form of sums:
/// without a first guess, and exact for any order of magnitude of the samples.
class StiffnessEstimator {
 public:
  static constexpr double kForgetting = 0.995;
  /// Shallower and slower samples say more about noise than about the tissue.
  static constexpr double kMinDepth_m = 0.001;
  static constexpr double kMinRate_m_per_s = 0.002;

  explicit StiffnessEstimator(double forgetting = kForgetting) : forgetting_(forgetting) {}

  /// Returns true if a sample is deep and fast enough to count.
  static bool counts(const PressSample& sample);
  /// Adds a sample if it counts; not finite: ignored.
  void add(const PressSample& sample);
  StiffnessEstimate estimate() const;

 private:
  double forgetting_;
  double weight_ = 0;  ///< sum of the samples' weights
  double dd_ = 0, dv_ = 0, vv_ = 0, fd_ = 0, fv_ = 0, ff_ = 0;
};

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
  static constexpr double kMinExcess = 0.25;

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

/// Returns the place that stands out by at least Palpation::kMinExcess, if there is one: the centroid of
/// the cells, weighted by how much their lower stiffness exceeds the median's.
std::optional<Nodule> findNodule(const std::vector<PalpatedCell>& cells);

/// Returns a table of the cells and a line about the nodule, for people.
std::string palpationText(const PalpationMap& map);

/// Returns the same as JSON, in SI units: `cells` and `nodule` (null: none).
std::string palpationJson(const PalpationMap& map);

}  // namespace hapticd::tools
