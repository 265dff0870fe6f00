// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>

namespace hapticd::base {

/// Limits what a client streams. Each that is taken uses up its part of a second; what was not used within
/// the last second may be taken at once. So of a stream that is too fast the surplus is refused evenly.
class RateLimit {
 public:
  using Clock = std::chrono::steady_clock;

  explicit RateLimit(int most_per_second)
      : part_(Clock::duration(std::chrono::seconds(1)) / most_per_second) {}

  /// Whether one more may be taken. `now`: not earlier than in the call before.
  bool allows(Clock::time_point now) {
    if (now - counted_.begin >= kWindow) {
      newest_ = now - counted_.begin < 2 * kWindow ? counted_ : Window{};
      counted_ = {now};
    }
    const Clock::time_point begin = std::max(used_until_, now - kWindow);
    const bool allowed = now - begin >= part_;
    if (allowed) used_until_ = begin + part_;
    ++counted_.came;
    counted_.refused += allowed ? 0 : 1;
    return allowed;
  }

  /// How many came in the newest second if some of them were refused; 0: all were taken, or none comes.
  int excess(Clock::time_point now) const {
    return newest_.refused > 0 && now - counted_.begin < 2 * kWindow ? newest_.came : 0;
  }

 private:
  static constexpr Clock::duration kWindow = std::chrono::seconds(1);
  /// What came within about a second.
  struct Window {
    Clock::time_point begin{};
    int came = 0;
    int refused = 0;
  };

  Clock::duration part_;  // of a second, for each
  Clock::time_point used_until_{};
  Window counted_;
  Window newest_;  // the one before counted_
};

}  // namespace hapticd::base
