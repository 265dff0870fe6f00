// SPDX-License-Identifier: Apache-2.0
#include "rt/periodic_clock.h"

#include <cerrno>
#include <ctime>

namespace hapticd::rt {
namespace {

constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;

}  // namespace

// The two system calls of the force thread. clang's effect analysis does not know the C library; both calls
// are documented neither to lock nor to allocate: clock_gettime runs in user space, and clock_nanosleep is
// how a periodic thread waits.
HAPTICD_RT_TRUSTED_BEGIN

std::int64_t monotonicNow_ns() HAPTICD_RT {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kNanosecondsPerSecond + now.tv_nsec;
}

void sleepUntil(std::int64_t time_ns) HAPTICD_RT {
  const timespec until{time_ns / kNanosecondsPerSecond, time_ns % kNanosecondsPerSecond};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

HAPTICD_RT_TRUSTED_END

}  // namespace hapticd::rt
