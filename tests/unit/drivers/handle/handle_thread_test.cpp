// SPDX-License-Identifier: Apache-2.0
// Features shared by all drivers: which commands pass, how their threads are scheduled, and how much CPU time
// the network may cause.

#include "drivers/handle/handle_thread.h"

#include <gtest/gtest.h>
#include <sched.h>

#include <atomic>
#include <cerrno>
#include <future>

#include "drivers/handle/command_gate.h"
#include "drivers/handle/hid/hid_settings.h"
#include "drivers/handle/udp/udp_handle.h"
#include "rt/base/realtime_thread.h"
#include "tests/support/rerun.h"

namespace hapticd::drivers {
namespace {

using rt::Vec3;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kNow = 5'000 * kMs;

TEST(CommandGate, PassesTheCommandsOfTheSessionWhileTheyAreYoung) {
  CommandGate gate;
  const Vec3 force{1, 2, 3};
  EXPECT_EQ(gate.pass({force, 7, 2, kNow}, 2, kNow), force);
  EXPECT_EQ(gate.pass({force, 7, 2, kNow}, 2, kNow + 20 * kMs), force);
  EXPECT_EQ(gate.pass({force, 7, 2, kNow}, 2, kNow + 20 * kMs + 1), std::nullopt)
      << "the force loop has stalled";
  EXPECT_EQ(gate.pass({force, 8, 1, kNow}, 2, kNow), std::nullopt) << "of the session before";
  EXPECT_EQ(gate.pass({force, 8, 3, kNow}, 2, kNow), std::nullopt);
  EXPECT_EQ(gate.pass({}, 0, 0), std::nullopt) << "nobody has commanded yet";
}

TEST(CommandGate, MeasuresEachSentCommandOnce) {
  CommandGate gate;
  EXPECT_EQ(gate.latency_ns(), 0);
  EXPECT_FALSE(gate.lastHop());
  gate.pass({{}, 1, 1, kNow}, 1, kNow + 5);
  gate.sent(kNow + 10);
  gate.pass({{}, 1, 1, kNow}, 1, kNow + kMs);
  gate.sent(kNow + kMs);  // the same again, because there is no newer one
  gate.pass({{}, 2, 9, kNow + 30}, 1, kNow + 31);
  gate.sent(kNow + 2 * kMs);  // not counted: it did not pass
  EXPECT_EQ(gate.latency_ns(), 10);
  gate.pass({{}, 2, 1, kNow + 50}, 1, kNow + 55);
  gate.sent(kNow + 65);
  EXPECT_EQ(gate.latency_ns(), 15);
  ASSERT_TRUE(gate.lastHop());
  EXPECT_EQ(gate.lastHop()->p50_ns, 10U);
  EXPECT_EQ(gate.lastHop()->max_ns, 15U);
}

TEST(CommandGate, CountsTheWaitOfTheFirstCommandThatANewerOneReplaced) {
  CommandGate gate;
  gate.pass({{}, 10, 1, kNow}, 1, kNow);
  gate.sent(kNow + 5);
  gate.pass({{}, 15, 1, kNow + 5 * kMs}, 1, kNow + 5 * kMs);
  gate.sent(kNow + 5 * kMs + 7);  // tick 11, written at kNow + 1 ms, waited until then
  EXPECT_EQ(gate.latency_ns(), 4 * kMs + 7);
  gate.pass({{}, 900, 2, kNow + 900 * kMs}, 2, kNow + 900 * kMs);
  gate.sent(kNow + 900 * kMs + 9);
  EXPECT_EQ(gate.latency_ns(), 9) << "nothing was to be sent before the device came back";
}

TEST(HandleThreadPolicy, IsSecondToTheForceThreadWhereForcesAreCarried) {
  config::HandleSettings settings;
  for (const auto driver : {"simulated", "udp", "hid", "falcon"}) {
    settings.driver = driver;
    EXPECT_EQ(handleThreadPolicy(settings, {.priority = 80}, -1).priority, 79);
    EXPECT_EQ(handleThreadPolicy(settings, {.priority = 1}, -1).priority, 0);
  }
  settings.driver = "hid";
  settings.of<HidHandleSettings>().kind = HidKind::spacemouse;
  EXPECT_EQ(handleThreadPolicy(settings, {.priority = 80}, -1).priority, 0) << "it exerts no force";
  EXPECT_EQ(handleThreadPolicy(settings, {.priority = 80}, 3).avoided_cpu, 3);
}

struct Seen {
  int policy = 0;
  int priority = 0;
  cpu_set_t cpus{};
};

/// Returns how a thread with that policy is scheduled once started.
Seen schedulingOf(const HandleThreadPolicy& policy, HandleScheduling& reported) {
  std::promise<void> go;
  Seen seen;
  auto started = startHandleThread(policy, [&seen, started = go.get_future().share()] {
    started.wait();
    sched_param parameters{};
    ::pthread_getschedparam(::pthread_self(), &seen.policy, &parameters);
    seen.priority = parameters.sched_priority;
    ::sched_getaffinity(0, sizeof seen.cpus, &seen.cpus);
  });
  EXPECT_TRUE(started);
  reported = started->scheduling;
  go.set_value();
  started->thread.join();
  return seen;
}

TEST(HandleThread, IsScheduledAsReported) {
  HandleScheduling reported;
  const Seen seen = schedulingOf({.priority = 7}, reported);
  EXPECT_EQ(reported.requested_priority, 7);
  EXPECT_EQ(seen.policy, reported.priority > 0 ? SCHED_FIFO : SCHED_OTHER);
  EXPECT_EQ(seen.priority, reported.priority);
  const bool permitted = std::async(std::launch::async, [] { return rt::useRealtimeScheduling(7); }).get();
  EXPECT_EQ(reported.priority, permitted ? 7 : 0);
  if (!permitted)
    test::reportNotChecked("a handle's thread under SCHED_FIFO: not permitted here (RLIMIT_RTPRIO)");
  EXPECT_EQ(schedulingOf({}, reported).policy, SCHED_OTHER);
  EXPECT_EQ(reported.requested_priority, 0);
}

TEST(HandleThread, LeavesTheForceThreadsCpuAloneUnlessItIsTheOnlyOne) {
  cpu_set_t usable;
  ASSERT_EQ(::sched_getaffinity(0, sizeof usable, &usable), 0);
  std::size_t first = 0;
  while (!CPU_ISSET(first, &usable)) ++first;
  HandleScheduling reported;
  const Seen seen = schedulingOf({.avoided_cpu = static_cast<int>(first)}, reported);
  EXPECT_EQ(CPU_ISSET(first, &seen.cpus) != 0, CPU_COUNT(&usable) == 1);
  EXPECT_EQ(CPU_COUNT(&seen.cpus), std::max(1, CPU_COUNT(&usable) - 1));
}

TEST(CpuBudget, LetsAThreadWorkHalfOfTheTimeWhateverComes) {
  udp::CpuBudget budget;
  std::int64_t now_ns = kNow;
  std::int64_t worked_ns = 0;
  for (int round = 0; round < 100'000; ++round) {
    now_ns += budget.restNs(worked_ns, now_ns);
    constexpr std::int64_t kRound_ns = 100'000;  // always busy
    now_ns += kRound_ns;
    worked_ns += kRound_ns;
  }
  const double share = static_cast<double>(worked_ns) / static_cast<double>(now_ns - kNow);
  EXPECT_GT(share, 0.4);
  // A window may exceed its half by one round, because it is checked between rounds.
  EXPECT_LE(share, 0.5 + 2 * 0.1 / 2);
}

TEST(CpuBudget, NeverKeepsAThreadThatWorksALittleFromItsWork) {
  udp::CpuBudget budget;
  for (std::int64_t ms = 0; ms < 1000; ++ms) {
    EXPECT_EQ(budget.restNs(ms * 100'000, kNow + ms * kMs), 0);
  }
}

}  // namespace
}  // namespace hapticd::drivers
