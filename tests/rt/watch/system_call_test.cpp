// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <string>
#include <thread>

#include "rt/base/clock.h"
#include "rt/loop/force_loop.h"
#include "tests/rt/loop_rig.h"
#include "tests/rt/watch/only_clock_calls.h"
#include "tests/rt/watch/watch.h"
#include "tests/support/rerun.h"

// Checks the force thread's system calls with a kernel filter that ends the process at any call except those
// of the clock.

namespace hapticd::test {
namespace {

constexpr int kUnavailable = 77;
constexpr std::size_t kTicks = 300;

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
