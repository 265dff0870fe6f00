// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace hapticd::tools {

/// Spread of repeated measurements of one duration, microseconds.
struct Durations {
  std::size_t count = 0;
  double median_us = 0;
  double p99_us = 0;
  double max_us = 0;

  static Durations of(std::vector<std::int64_t> nanoseconds) {
    if (nanoseconds.empty()) return {};
    std::sort(nanoseconds.begin(), nanoseconds.end());
    const auto at = [&nanoseconds](double quantile) {
      const auto last = static_cast<double>(nanoseconds.size() - 1);
      return static_cast<double>(nanoseconds[static_cast<std::size_t>(quantile * last)]) / 1000;
    };
    return {nanoseconds.size(), at(0.5), at(0.99), at(1)};
  }
};

}  // namespace hapticd::tools
