// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <string>
#include <thread>

#include "rt/base/clock.h"
#include "rt/loop/force_loop.h"
#include "tests/rt/loop_rig.h"
#include "tests/rt/watch/watch.h"
#include "tests/support/rerun.h"

// Checks the force thread's system calls with a kernel filter that ends the process at any call except those
// of the clock.

namespace hapticd::test {
namespace {

constexpr int kUnavailable = 77;
constexpr std::size_t kTicks = 300;

/// Makes the kernel end the process at every further system call of the calling thread except reading and
/// sleeping on the clock. Returns false if the kernel or a sandbox does not support this. Cannot be undone.
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

/// Runs in a process of its own. A restricted thread cannot even end, so the process ends while it sleeps.
[[noreturn]] void runRestricted(bool with_a_planted_call) {
  LoopRig rig;
  std::atomic<bool> returned{false};
  std::thread force_thread([&] {
    rig.loop.prepare();
    if (!allowOnlyClockCalls()) std::_Exit(kUnavailable);
    if (with_a_planted_call) ::syscall(SYS_getpid);
    rig.loop.run();
    returned.store(true);
    rt::sleepUntil(std::numeric_limits<std::int64_t>::max());
  });
  const bool fine = exercise(rig, kTicks);
  rig.loop.requestStop();
  std::_Exit(fine && becomesTrue([&] { return returned.load(); }) ? EXIT_SUCCESS : EXIT_FAILURE);
}

class ForceThreadSystemCalls : public testing::Test {
 protected:
  /// Returns false, with a message, if this cannot be checked here.
  static bool canBeJudged(const Finished& process) {
    if (process.ending == exitedWith(kUnavailable)) {
      reportNotChecked("which system calls the force thread makes: the kernel offers no seccomp filter here");
      return false;
    }
    return true;
  }
  void SetUp() override {
    if (!kSight.exceptions) {
      reportNotChecked(
          "which system calls the force thread makes: a sanitizer adds its own, builds without one "
          "(preset dev) do it");
      can_be_judged_ = false;
    }
  }
  bool can_be_judged_ = true;
};

TEST_F(ForceThreadSystemCalls, AreOnlyTheClocks) {
  if (rerunPart() == "loop") runRestricted(false);
  if (!can_be_judged_) return;
  const Finished process = rerunThisTest("loop");
  if (!canBeJudged(process)) return;
  EXPECT_EQ(process.ending, exitedWith(EXIT_SUCCESS)) << process.errors;
}

TEST_F(ForceThreadSystemCalls, EndTheProcessWhenOneIsPlanted) {
  if (rerunPart() == "planted") runRestricted(true);
  if (!can_be_judged_) return;
  const Finished process = rerunThisTest("planted");
  if (!canBeJudged(process)) return;
  EXPECT_EQ(process.ending, (Ending{.exited = false, .code = SIGSYS}));
}

}  // namespace
}  // namespace hapticd::test
