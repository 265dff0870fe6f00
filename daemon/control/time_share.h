// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>

namespace hapticd::daemon {

/// How much of a thread's time one kind of work may take: so much in each period. What it took beyond that is
/// taken off the periods behind. Thread: one.
class TimeShare {
 public:
  explicit TimeShare(std::chrono::nanoseconds per_period) noexcept
      : per_period_(per_period), left_(per_period) {}

  /// To be called once in a period. What was left over is not saved.
  void beginPeriod() noexcept { left_ = std::min(per_period_, left_ + per_period_); }
  void spend(std::chrono::nanoseconds time) noexcept { left_ -= time; }
  /// Whether more work may begin in this period.
  bool isLeft() const noexcept { return left_.count() > 0; }

 private:
  std::chrono::nanoseconds per_period_;
  std::chrono::nanoseconds left_;
};

}  // namespace hapticd::daemon
