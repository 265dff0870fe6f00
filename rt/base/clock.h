// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ctime>

#include <cstdint>

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

}  // namespace hapticd::rt
