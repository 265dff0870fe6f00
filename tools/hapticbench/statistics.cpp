// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/statistics.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hapticd::tools {

double Exceedance::percent() const {
  return percentOf(above, ticks);
}

void Exceedance::add(const Exceedance& other) {
  ticks += other.ticks;
  above += other.above;
  longest = std::max(longest, other.longest);
  largest = std::max(largest, other.largest);
}

Exceedance exceedance(std::span<const double> values, double limit) {
  Exceedance result{.ticks = values.size()};
  std::size_t run = 0;
  for (const double value : values) {
    run = value > limit ? run + 1 : 0;
    result.above += run > 0 ? 1 : 0;
    result.longest = std::max(result.longest, run);
    result.largest = std::max(result.largest, value);
  }
  return result;
}

double percentOf(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0 : 100 * static_cast<double>(part) / static_cast<double>(whole);
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto last = static_cast<double>(values.size() - 1);
  const auto place = values.begin() + std::lround(share * last);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

double robustDeviation(std::vector<double> residuals) {
  constexpr double kNormalDeviation = 1.4826;  // of a normal distribution whose median magnitude is one
  for (double& residual : residuals) residual = std::abs(residual);
  return kNormalDeviation * quantile(std::move(residuals), 0.5);
}

double rootMeanSquare(std::span<const double> values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return values.empty() ? 0 : std::sqrt(sum / static_cast<double>(values.size()));
}

}  // namespace hapticd::tools
