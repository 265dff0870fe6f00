// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <ctime>

#include "rt/base/realtime_safe.h"

namespace hapticd::rt {

inline constexpr std::int64_t kNsPerSecond = 1'000'000'000;

// clang's effect analysis knows nothing of the C library; clock_gettime of these two clocks is answered in
// user space, without a lock and without an allocation.
HAPTICD_RT_TRUSTED_BEGIN

/// CLOCK_MONOTONIC in nanoseconds.  Thread: any.  RT: safe.
inline std::int64_t monotonicNow_ns() HAPTICD_RT {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * kNsPerSecond + now.tv_nsec;
}

/// CLOCK_REALTIME in nanoseconds since the epoch.  Thread: any.  RT: safe.
inline std::int64_t realtimeNow_ns() HAPTICD_RT {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  return std::int64_t{now.tv_sec} * kNsPerSecond + now.tv_nsec;
}

HAPTICD_RT_TRUSTED_END

/// CPU time that the calling thread has used, in nanoseconds.  Thread: any.  RT: not safe, a system call.
inline std::int64_t threadCpu_ns() noexcept {
  timespec used{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
  return std::int64_t{used.tv_sec} * kNsPerSecond + used.tv_nsec;
}

/// Sleeps until an absolute CLOCK_MONOTONIC time; returns at once when it is past.  RT: safe.
void sleepUntil(std::int64_t time_ns) HAPTICD_RT;

/// A fixed grid of times, one period apart. A tick that ends after the next one is due is an overrun: whole
/// periods are skipped and counted, and the grid keeps its phase.
/// Thread: one.  RT: safe.
class PeriodicClock {
 public:
  explicit PeriodicClock(std::int64_t period_ns) noexcept : period_ns_(period_ns) {}

  /// Starts the grid; the first tick is due one period after `now_ns`.
  void start(std::int64_t now_ns) HAPTICD_RT { next_ns_ = now_ns + period_ns_; }

  /// Returns the time at which the current tick is (or was) due.
  std::int64_t planned_ns() const HAPTICD_RT { return next_ns_; }

  /// Advances to the next tick after `now_ns`, the end of the current one. Returns the number of skipped
  /// periods; 0 if the next tick is still to come.
  std::uint64_t advance(std::int64_t now_ns) HAPTICD_RT {
    next_ns_ += period_ns_;
    if (now_ns < next_ns_) return 0;
    const std::int64_t skipped = (now_ns - next_ns_) / period_ns_ + 1;
    next_ns_ += skipped * period_ns_;
    return static_cast<std::uint64_t>(skipped);
  }

 private:
  std::int64_t period_ns_;
  std::int64_t next_ns_ = 0;
};

}  // namespace hapticd::rt
