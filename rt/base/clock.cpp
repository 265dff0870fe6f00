// SPDX-License-Identifier: Apache-2.0
#include "rt/base/clock.h"

#include <cerrno>
#include <ctime>

namespace hapticd::rt {

// The system call that the force thread waits by. clang's effect analysis knows nothing of the C library;
// that clock_nanosleep neither takes a lock nor allocates is documented.
HAPTICD_RT_TRUSTED_BEGIN

void sleepUntil(std::int64_t time_ns) HAPTICD_RT {
  const timespec until{time_ns / kNsPerSecond, time_ns % kNsPerSecond};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

HAPTICD_RT_TRUSTED_END

}  // namespace hapticd::rt
