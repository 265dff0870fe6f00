// SPDX-License-Identifier: Apache-2.0
#include "tests/rt/watch/only_clock_calls.h"

#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cstddef>

namespace hapticd::test {

bool allowOnlyClockCalls() {
  constexpr auto kLoadNumber = static_cast<unsigned short>(BPF_LD | BPF_W | BPF_ABS);
  constexpr auto kSkipUnlessEqual = static_cast<unsigned short>(BPF_JMP | BPF_JEQ | BPF_K);
  constexpr auto kReturn = static_cast<unsigned short>(BPF_RET | BPF_K);
  // clock_gettime is a system call only where the clock cannot be read in user space.
  std::array<sock_filter, 6> filter{{
      {kLoadNumber, 0, 0, offsetof(seccomp_data, nr)},
      {kSkipUnlessEqual, 3, 0, SYS_clock_nanosleep},
      {kSkipUnlessEqual, 2, 0, SYS_clock_gettime},
      {kSkipUnlessEqual, 1, 0, SYS_restart_syscall},
      {kReturn, 0, 0, SECCOMP_RET_KILL_PROCESS},
      {kReturn, 0, 0, SECCOMP_RET_ALLOW},
  }};
  const sock_fprog program{static_cast<unsigned short>(filter.size()), filter.data()};
  return ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

}  // namespace hapticd::test
