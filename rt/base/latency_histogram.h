// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <type_traits>

#include "rt/base/fields.h"

namespace hapticd::rt {

/// Distribution of durations in nanoseconds, from 0 ns to 4.3 s, with a relative resolution of 1/16; longer
/// durations count as the longest.
/// Thread: one writer (add), any number of readers; a reader sees each counter at some recent value.
/// Progress: wait-free.  RT: safe.
class LatencyHistogram {
 public:
  void add(std::int64_t duration_ns) noexcept {
    const std::uint64_t ns = duration_ns > 0 ? static_cast<std::uint64_t>(duration_ns) : 0;
    increment(counts_[bucketOf(ns)]);
    increment(total_);
    if (ns > max_ns_.load(std::memory_order_relaxed)) max_ns_.store(ns, std::memory_order_relaxed);
  }

  std::uint64_t total() const noexcept { return total_.load(std::memory_order_relaxed); }
  std::uint64_t maxNs() const noexcept { return max_ns_.load(std::memory_order_relaxed); }

  /// Returns the upper end of the bucket that contains the quantile (0..1), at most maxNs(); 0 while the
  /// histogram is empty.
  std::uint64_t quantileNs(double quantile) const noexcept {
    std::uint64_t counted = 0;
    for (const Counter& count : counts_) counted += count.load(std::memory_order_relaxed);
    const double rank = quantile * static_cast<double>(counted);
    std::uint64_t below = 0;
    for (std::size_t bucket = 0; bucket < kBuckets; ++bucket) {
      below += counts_[bucket].load(std::memory_order_relaxed);
      if (below != 0 && static_cast<double>(below) >= rank) return std::min(upperEndNs(bucket), maxNs());
    }
    return maxNs();
  }

 private:
  using Counter = std::atomic<std::uint64_t>;
  static constexpr int kSubBits = 4;  // 16 buckets per power of two
  static constexpr std::size_t kBuckets = (32 - kSubBits + 1) << kSubBits;

  static void increment(Counter& counter) noexcept {  // a single writer needs no atomic read-modify-write
    counter.store(counter.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  static std::size_t bucketOf(std::uint64_t ns) noexcept {
    if (ns >> 32 != 0) return kBuckets - 1;
    if (ns < (1U << kSubBits)) return ns;
    const int shift = static_cast<int>(std::bit_width(ns)) - 1 - kSubBits;
    return (static_cast<std::size_t>(shift) << kSubBits) + (ns >> shift);
  }
  static std::uint64_t upperEndNs(std::size_t bucket) noexcept {
    if (bucket < (2U << kSubBits)) return bucket;
    const std::size_t shift = (bucket >> kSubBits) - 1;
    const std::uint64_t mantissa = (bucket & ((1U << kSubBits) - 1)) + (1U << kSubBits);
    return ((mantissa + 1) << shift) - 1;
  }

  std::array<Counter, kBuckets> counts_{};
  Counter total_{0};
  Counter max_ns_{0};
};

/// Percentiles of a histogram in nanoseconds.
struct LatencySummary {
  std::uint64_t p50_ns = 0;
  std::uint64_t p99_ns = 0;
  std::uint64_t p999_ns = 0;
  std::uint64_t max_ns = 0;
};
template <std::same_as<LatencySummary> Status>
constexpr auto fieldsOf(std::type_identity<Status>) {
  return std::tuple{HAPTICD_FIELD(p50_ns, "Median"), HAPTICD_FIELD(p99_ns, "99th percentile"),
                    HAPTICD_FIELD(p999_ns, "99.9th percentile"), HAPTICD_FIELD(max_ns, "The longest")};
}

inline LatencySummary summaryOf(const LatencyHistogram& histogram) noexcept {
  return {histogram.quantileNs(0.5), histogram.quantileNs(0.99), histogram.quantileNs(0.999),
          histogram.maxNs()};
}

}  // namespace hapticd::rt
