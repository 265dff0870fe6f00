// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/pareto/cpu_cost.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

#include "rt/periodic_clock.h"

namespace hapticd::tools {
namespace {

void keepLeast(std::vector<std::int64_t>& kept, const std::vector<std::int64_t>& again) {
  if (kept.empty()) kept = again;
  for (std::size_t i = 0; i < std::min(kept.size(), again.size()); ++i) kept[i] = std::min(kept[i], again[i]);
}

double mean_us(const std::vector<std::int64_t>& ns) {
  if (ns.empty()) return 0;
  return static_cast<double>(std::accumulate(ns.begin(), ns.end(), std::int64_t{0})) /
         static_cast<double>(ns.size()) / 1000;
}

/// `sorted` in ascending order.
double quantile_us(const std::vector<std::int64_t>& sorted, double quantile) {
  if (sorted.empty()) return 0;
  const double last = static_cast<double>(sorted.size() - 1);
  return static_cast<double>(sorted[static_cast<std::size_t>(quantile * last)]) / 1000;
}

}  // namespace

void CostSamples::keepLeast(const CostSamples& again) {
  tools::keepLeast(model_ns, again.model_ns);
  tools::keepLeast(force_ns, again.force_ns);
}

void CostSamples::append(const CostSamples& more) {
  model_ns.insert(model_ns.end(), more.model_ns.begin(), more.model_ns.end());
  force_ns.insert(force_ns.end(), more.force_ns.begin(), more.force_ns.end());
}

CpuCost CpuCost::of(const CostSamples& samples) {
  CpuCost cost;
  cost.model_mean_us = mean_us(samples.model_ns);
  cost.force_mean_us = mean_us(samples.force_ns);
  std::vector<std::int64_t> sorted = samples.model_ns;
  std::sort(sorted.begin(), sorted.end());
  cost.model_median_us = quantile_us(sorted, 0.5);
  cost.model_max_us = quantile_us(sorted, 1);
  sorted = samples.force_ns;
  std::sort(sorted.begin(), sorted.end());
  cost.force_median_us = quantile_us(sorted, 0.5);
  cost.force_p999_us = quantile_us(sorted, 0.999);
  cost.force_max_us = quantile_us(sorted, 1);
  return cost;
}

std::int64_t clockCost_ns() {
  std::vector<std::int64_t> empty;
  for (int i = 0; i < 10001; ++i) {
    const std::int64_t begin_ns = rt::monotonicNow_ns();
    empty.push_back(rt::monotonicNow_ns() - begin_ns);
  }
  const auto middle = empty.begin() + 5000;
  std::nth_element(empty.begin(), middle, empty.end());
  return *middle;
}

}  // namespace hapticd::tools
