// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

namespace hapticd::daemon {

/// Counts what a client streams, second by second.
class RateLimit {
 public:
  using Clock = std::chrono::steady_clock;

  explicit RateLimit(int most_per_second) : most_per_second_(most_per_second) {}

  /// Whether one more may be taken. `now`: not earlier than in the call before.
  bool allows(Clock::time_point now) {
    if (now - second_ >= std::chrono::seconds(1)) {
      second_ = now;
      count_ = 0;
    }
    return ++count_ <= most_per_second_;
  }

 private:
  int most_per_second_;
  Clock::time_point second_{};  // begin of the second in which is counted
  int count_ = 0;
};

}  // namespace hapticd::daemon
