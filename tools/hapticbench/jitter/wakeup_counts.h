// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>

namespace hapticd::tools {

/// Number of wake-ups by their latency in whole microseconds, rounded down as cyclictest does.
/// Thread: one at a time.  RT: not safe.
class WakeupCounts {
 public:
  /// An early wake-up counts as one in time.
  void addLatency(std::int64_t latency_ns);
  void add(std::int64_t latency_us, std::uint64_t wakeups);
  void add(const WakeupCounts& others);

  std::uint64_t total() const { return total_; }
  /// The largest, 0 while empty.
  std::int64_t max_us() const { return counts_.empty() ? 0 : counts_.rbegin()->first; }
  /// The smallest latency that at least this share (0..1) of the wake-ups did not exceed; 0 while empty.
  std::int64_t quantile_us(double share) const;
  /// Returns the number of wake-ups by latency in us; only latencies that occurred.
  const std::map<std::int64_t, std::uint64_t>& counts() const { return counts_; }

 private:
  std::map<std::int64_t, std::uint64_t> counts_;
  std::uint64_t total_ = 0;
};

/// Returns `ours` / `theirs`, both in whole microseconds; values below one count as one.
double latencyRatio(std::int64_t ours_us, std::int64_t theirs_us);

}  // namespace hapticd::tools
