// SPDX-License-Identifier: Apache-2.0
#include "rt/base/realtime_thread.h"

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
#include <cstdint>

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
  // Large blocks go back to the system all the same: the limit rises with what was freed before, and the
  // megabytes that only the warm-up needs would then stay.
  mallopt(M_MMAP_THRESHOLD, 128 * 1024);
  return mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
}

void returnPages(void* begin, std::size_t bytes) noexcept {
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  const auto first = (reinterpret_cast<std::uintptr_t>(begin) + page - 1) / page * page;
  const auto end = (reinterpret_cast<std::uintptr_t>(begin) + bytes) / page * page;
  if (first >= end) return;
  void* const pages = reinterpret_cast<void*>(first);
  if (munlock(pages, end - first) == 0) madvise(pages, end - first, MADV_DONTNEED);
}

void limitThreadStacks() noexcept {
  // a sanitizer makes frames several times as large
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  pthread_attr_t attributes;
  if (pthread_attr_init(&attributes) != 0) return;
  if (pthread_attr_setstacksize(&attributes, kThreadStackBytes) == 0) pthread_setattr_default_np(&attributes);
  pthread_attr_destroy(&attributes);
#endif
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
  // larger pages, as of many ARM kernels, are touched several times
  constexpr std::size_t kMinPage = 4096;
  char stack[kBytes];
  volatile char* const pages = stack;
  for (std::size_t i = 0; i < kBytes; i += kMinPage) pages[i] = 0;
}

}  // namespace hapticd::rt
