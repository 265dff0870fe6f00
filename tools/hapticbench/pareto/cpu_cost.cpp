// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/pareto/cpu_cost.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

#include "rt/periodic_clock.h"
#include "tools/hapticbench/statistics.h"

namespace hapticd::tools {
namespace {

void keepLeast(std::vector<std::int64_t>& kept, const std::vector<std::int64_t>& again) {
  if (kept.empty()) kept = again;
  for (std::size_t i = 0; i < std::min(kept.size(), again.size()); ++i) kept[i] = std::min(kept[i], again[i]);
}

std::vector<double> inMicroseconds(const std::vector<std::int64_t>& ns) {
  std::vector<double> us;
  for (const std::int64_t value : ns) us.push_back(static_cast<double>(value) / 1000);
  return us;
}

double mean(const std::vector<double>& values) {
  if (values.empty()) return 0;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
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
  const std::vector<double> model_us = inMicroseconds(samples.model_ns);
  const std::vector<double> force_us = inMicroseconds(samples.force_ns);
  return {.model_median_us = quantile(model_us, 0.5),
          .model_mean_us = mean(model_us),
          .model_max_us = quantile(model_us, 1),
          .force_median_us = quantile(force_us, 0.5),
          .force_mean_us = mean(force_us),
          .force_p999_us = quantile(force_us, 0.999),
          .force_max_us = quantile(force_us, 1)};
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
