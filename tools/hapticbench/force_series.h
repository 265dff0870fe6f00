// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

/// What a series of values, one per tick of a millisecond, comes to.
namespace hapticd::tools {

/// How much of a series is above a limit.
struct Exceedance {
  std::size_t ticks = 0;    ///< of the series
  std::size_t above = 0;    ///< of these, above the limit
  std::size_t longest = 0;  ///< the longest run of them without a gap
  double largest = 0;

  double percent() const {
    return ticks == 0 ? 0 : 100 * static_cast<double>(above) / static_cast<double>(ticks);
  }
  /// As if the two series had been one with a gap between them.
  void add(const Exceedance& other);
};
Exceedance exceedance(std::span<const double> values, double limit);

/// The quantile `share` (0..1) of `values`, by the nearest rank; 0 for none.
double quantile(std::vector<double> values, double share);

/// Root of the mean square; 0 for none.
double rootMeanSquare(std::span<const double> values);

}  // namespace hapticd::tools
