// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

namespace hapticd::rt {

/// A spring whose force grows with the depth up to a limit, F = min(K d, F_max). The force is the derivative
/// of the energy, so the spring gives back what it took, whatever its values are.
struct SaturatingSpring {
  double stiffness_n_per_m = 0;  ///< K, > 0
  double max_force_n = 0;        ///< F_max, > 0

  /// Depth from which on the force no longer grows.
  constexpr double saturation_m() const noexcept { return max_force_n / stiffness_n_per_m; }
  /// `depth_m`: >= 0.
  constexpr double force_n(double depth_m) const noexcept {
    return std::min(stiffness_n_per_m * depth_m, max_force_n);
  }
  constexpr double energy_j(double depth_m) const noexcept {
    const double linear_m = std::min(depth_m, saturation_m());
    return 0.5 * stiffness_n_per_m * linear_m * linear_m + max_force_n * (depth_m - linear_m);
  }
};

}  // namespace hapticd::rt
