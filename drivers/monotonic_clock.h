// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ctime>

#include <cstdint>

namespace hapticd::drivers {

inline constexpr std::int64_t kNsPerSecond = 1'000'000'000;

/// Returns CLOCK_MONOTONIC in nanoseconds.  Thread: any.  RT: safe.
inline std::int64_t monotonicNs() noexcept {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * kNsPerSecond + now.tv_nsec;
}

/// Returns the CPU time used by the calling thread in nanoseconds.  Thread: any.
inline std::int64_t threadCpuNs() noexcept {
  timespec worked{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &worked);
  return std::int64_t{worked.tv_sec} * kNsPerSecond + worked.tv_nsec;
}

/// Returns CLOCK_REALTIME in nanoseconds.  Thread: any.  RT: safe.
inline std::int64_t realtimeNs() noexcept {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  return std::int64_t{now.tv_sec} * kNsPerSecond + now.tv_nsec;
}

}  // namespace hapticd::drivers
