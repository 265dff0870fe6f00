// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/jitter/wakeup_counts.h"

#include <algorithm>

namespace hapticd::tools {

void WakeupCounts::addLatency(std::int64_t latency_ns) {
  constexpr std::int64_t kNsPerUs = 1000;
  add(std::max<std::int64_t>(latency_ns, 0) / kNsPerUs, 1);
}

void WakeupCounts::add(std::int64_t latency_us, std::uint64_t wakeups) {
  if (wakeups == 0) return;
  counts_[latency_us] += wakeups;
  total_ += wakeups;
}

void WakeupCounts::add(const WakeupCounts& others) {
  for (const auto& [latency_us, wakeups] : others.counts_) add(latency_us, wakeups);
}

std::int64_t WakeupCounts::quantile_us(double share) const {
  const double rank = share * static_cast<double>(total_);
  std::uint64_t not_above = 0;
  for (const auto& [latency_us, wakeups] : counts_) {
    not_above += wakeups;
    if (static_cast<double>(not_above) >= rank) return latency_us;
  }
  return max_us();
}

double latencyRatio(std::int64_t ours_us, std::int64_t theirs_us) {
  return static_cast<double>(std::max<std::int64_t>(ours_us, 1)) /
         static_cast<double>(std::max<std::int64_t>(theirs_us, 1));
}

}  // namespace hapticd::tools
