// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>

namespace hapticd::daemon {

/// Limits the time of a thread that one kind of work may take in each period. Time taken beyond the limit is
/// deducted from the following periods. Thread: one.
class TimeShare {
 public:
  explicit TimeShare(std::chrono::nanoseconds per_period) noexcept
      : per_period_(per_period), left_(per_period) {}

  /// To be called once in a period. Unused time is not saved for later periods.
  void beginPeriod() noexcept { left_ = std::min(per_period_, left_ + per_period_); }
  void spend(std::chrono::nanoseconds time) noexcept { left_ -= time; }
  /// Whether more work may begin in this period.
  bool isLeft() const noexcept { return left_.count() > 0; }

 private:
  std::chrono::nanoseconds per_period_;
  std::chrono::nanoseconds left_;
};

}  // namespace hapticd::daemon
