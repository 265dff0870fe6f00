// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace hapticd::drivers::udp {

/// Converts times of the other computer's monotonic clock to this one's, assuming for every packet the
/// smallest latency of the last one to two seconds. A delayed packet therefore shows as age, and the spacing
/// of the measurements is preserved. The window follows clock drift.
/// Thread: one.  Progress: wait-free.  RT: safe.
class PeerClock {
 public:
  /// Returns when the packet was made, by our clock; never after `arrived_ns`. The difference of the two
  /// times must not overflow.
  std::int64_t ourTimeNs(std::int64_t their_ns, std::int64_t arrived_ns) {
    const std::int64_t difference_ns = arrived_ns - their_ns;
    if (arrived_ns - window_began_ns_ >= kWindowNs) {
      before_ns_ = window_began_ns_ == 0 ? difference_ns : current_ns_;
      current_ns_ = difference_ns;
      window_began_ns_ = arrived_ns;
    }
    current_ns_ = std::min(current_ns_, difference_ns);
    return their_ns + std::min(current_ns_, before_ns_);
  }

  void reset() { *this = {}; }

 private:
  static constexpr std::int64_t kWindowNs = 1'000'000'000;

  std::int64_t window_began_ns_ = 0;
  std::int64_t current_ns_ = std::numeric_limits<std::int64_t>::max();  // smallest difference in this window
  // Smallest difference in the previous window.
  std::int64_t before_ns_ = std::numeric_limits<std::int64_t>::max();
};

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
