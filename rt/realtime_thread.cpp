// SPDX-License-Identifier: Apache-2.0
#include "rt/realtime_thread.h"

#include <linux/capability.h>
#include <malloc.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cfenv>
#include <cstddef>

namespace hapticd::rt {

namespace {

/// Returns true if the limit on locked memory does not apply to this process.
bool mayLockAnything() noexcept {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  __user_cap_data_struct data[_LINUX_CAPABILITY_U32S_3]{};
  if (syscall(SYS_capget, &header, data) != 0) return false;
  return (data[CAP_TO_INDEX(CAP_IPC_LOCK)].effective & CAP_TO_MASK(CAP_IPC_LOCK)) != 0;
}

}  // namespace

bool lockMemory() noexcept {
  // With a limit in force, locking all future memory would make an allocation beyond it fail. A privileged
  // process is not subject to the limit or raises it first.
  rlimit limit{};
  if (getrlimit(RLIMIT_MEMLOCK, &limit) != 0) return false;
  if (limit.rlim_cur != RLIM_INFINITY && !mayLockAnything()) {
    const rlimit unlimited{RLIM_INFINITY, RLIM_INFINITY};
    if (setrlimit(RLIMIT_MEMLOCK, &unlimited) != 0) return false;
  }
  mallopt(M_TRIM_THRESHOLD, -1);  // keep freed memory, so that it need not be faulted in again
  return mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
}

bool useRealtimeScheduling(int priority) noexcept {
  sched_param parameters{};
  parameters.sched_priority = priority;
  return pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters) == 0;
}

int pinToCpu(int cpu) noexcept {
  cpu_set_t set;
  if (cpu < 0) {
    if (sched_getaffinity(0, sizeof set, &set) != 0) return -1;
    for (std::size_t candidate = 0; candidate < CPU_SETSIZE; ++candidate) {
      if (CPU_ISSET(candidate, &set)) cpu = static_cast<int>(candidate);
    }
  }
  if (cpu < 0 || cpu >= CPU_SETSIZE) return -1;
  CPU_ZERO(&set);
  CPU_SET(static_cast<std::size_t>(cpu), &set);
  return pthread_setaffinity_np(pthread_self(), sizeof set, &set) == 0 ? cpu : -1;
}

void useDefaultFloatingPoint() noexcept {
  std::fesetenv(FE_DFL_ENV);
}

void prefaultStack() noexcept {
  constexpr std::size_t kBytes = 128 * 1024;
  constexpr std::size_t kSmallestPage =
      4096;  // a larger one, as of many ARM kernels, is touched several times
  char stack[kBytes];
  volatile char* const pages = stack;
  for (std::size_t i = 0; i < kBytes; i += kSmallestPage) pages[i] = 0;
}

}  // namespace hapticd::rt
