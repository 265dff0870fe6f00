// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
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

}  // namespace hapticd::drivers::udp
