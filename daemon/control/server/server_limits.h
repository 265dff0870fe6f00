// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <vector>

#include "config/base/descriptor.h"

namespace hapticd::daemon {

/// Limits on the number of simultaneous connections.
struct ConnectionLimits {
  std::size_t all = 0;
  std::size_t per_user = 0;
};

/// All connections that a server keeps.
struct ServerLimits {
  ConnectionLimits read;
  ConnectionLimits control;
  std::size_t lingering = 0;  ///< that got their final reply
};

/// Returns `limits`, or less where the process may have only `descriptors` more: what is left to files and
/// devices must suffice for them, and no user may take all places.
ServerLimits limitsWithin(const ServerLimits& limits, std::size_t descriptors);

/// How many more descriptors the process may open by its limit (RLIMIT_NOFILE).
std::size_t freeDescriptors();

/// Descriptors that are kept open, to be given up when a connection must be accepted and the process may open
/// no more.  Thread: one.
class DescriptorReserve {
 public:
  /// Holds none yet.
  explicit DescriptorReserve(std::size_t size) : size_(size) {}

  std::size_t held() const noexcept { return held_.size(); }
  /// Gives one up; does nothing if none is held.
  void release() {
    if (!held_.empty()) held_.pop_back();
  }
  /// Opens as many again as the system allows.
  void refill();

 private:
  std::size_t size_;
  std::vector<base::Descriptor> held_;
};

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
