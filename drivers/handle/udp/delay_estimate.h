// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace hapticd::drivers::udp {

/// The delay that the force loop must assume: the 95th percentile of the last kSamples delays. A median would
/// permit a stiffness for which every other force is too late; a maximum would let one late packet soften the
/// contact.
/// Thread: one.  Progress: wait-free.  RT: safe.
class DelayEstimate {
 public:
  static constexpr std::size_t kSamples = 256;

  void add(std::int64_t delay_ns) {
    samples_[next_] = delay_ns;
    next_ = (next_ + 1) % kSamples;
    count_ = std::min(count_ + 1, kSamples);
  }

  /// Returns the 95th percentile in nanoseconds; 0 without samples.
  std::int64_t ninetyFifthPercentileNs() const {
    if (count_ == 0) return 0;
    std::array<std::int64_t, kSamples> sorted = samples_;
    const auto rank = sorted.begin() + static_cast<std::ptrdiff_t>((count_ - 1) * 95 / 100);
    std::nth_element(sorted.begin(), rank, sorted.begin() + static_cast<std::ptrdiff_t>(count_));
    return *rank;
  }

  void reset() { next_ = count_ = 0; }

 private:
  std::array<std::int64_t, kSamples> samples_{};
  std::size_t next_ = 0;
  std::size_t count_ = 0;
};

}  // namespace hapticd::drivers::udp
