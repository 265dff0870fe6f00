// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "tools/lib/parts/is.h"

namespace hapticd::tools {

/// Root mean square and maximum of values, none of them negative.
class Spread {
 public:
  void add(double value) {
    ++count_;
    sum_of_squares_ += value * value;
    max_ = std::max(max_, value);
  }
  void add(const Spread& other) {
    count_ += other.count_;
    sum_of_squares_ += other.sum_of_squares_;
    max_ = std::max(max_, other.max_);
  }
  std::size_t count() const { return count_; }
  /// Returns the root mean square; 0 if nothing was added.
  double rms() const { return count_ == 0 ? 0 : std::sqrt(sum_of_squares_ / static_cast<double>(count_)); }
  double max() const { return max_; }

  friend auto fieldsOf(Is<Spread> auto& spread) {
    return std::tie(spread.count_, spread.sum_of_squares_, spread.max_);
  }

 private:
  std::size_t count_ = 0;
  double sum_of_squares_ = 0;
  double max_ = 0;
};

/// Statistics of a series of values, one per millisecond, above a limit.
struct Exceedance {
  std::size_t ticks = 0;    ///< of the series
  std::size_t above = 0;    ///< of these, above the limit
  std::size_t longest = 0;  ///< the longest run of ticks above the limit without a gap
  double largest = 0;

  double percent() const;
  /// Adds the statistics of another series, as if both were one series with a gap between them.
  void add(const Exceedance& other);
};
Exceedance exceedance(std::span<const double> values, double limit);

/// Returns `part` of `whole` in percent; 0 if `whole` is 0.
double percentOf(std::size_t part, std::size_t whole);

/// Returns the quantile `share` (0..1) of `values`, by the nearest rank; 0 without values.
double quantile(std::vector<double> values, double share);

/// Standard deviation of normally distributed residuals by the median of their magnitudes, which few outliers
/// do not change.
double robustDeviation(std::vector<double> residuals);

/// Returns the root mean square; 0 without values.
double rootMeanSquare(std::span<const double> values);

}  // namespace hapticd::tools
