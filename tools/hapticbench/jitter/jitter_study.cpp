// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/jitter/jitter_study.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>

#include "drivers/base/idle_latency.h"
#include "rt/realtime_thread.h"
#include "tools/hapticbench/jitter/cpus.h"
#include "tools/lib/child/child_process.h"

namespace hapticd::tools {
namespace {

config::Result<int> cpuOf(int requested) {
  const std::vector<int> usable = usableCpus();
  if (usable.empty()) return std::unexpected(config::Error{"--cpu", "no usable CPU is known", ""});
  if (requested < 0) return usable.back();
  if (std::ranges::find(usable, requested) != usable.end()) return requested;
  return std::unexpected(config::Error{"--cpu", fmt::format("{} is not one of this process", requested),
                                       fmt::format("allowed are {}", fmt::join(usable, ", "))});
}

/// Whether this process may have SCHED_FIFO, tried in a thread that ends at once.
config::Result<void> checkPermission(int priority) {
  bool permitted = false;
  std::thread([&] { permitted = rt::useRealtimeScheduling(priority); }).join();
  if (permitted) return {};
  return std::unexpected(config::Error{"SCHED_FIFO", fmt::format("priority {} is not permitted", priority),
                                       "run as root, or with an rtprio line in limits.conf"});
}

config::Result<JitterRound> measureRound(const LoopSetting& setting, const Interrupt& interrupt,
                                         bool ours_first) {
  config::Result<LoopRun> ours;
  if (ours_first) ours = runForceLoop(setting, interrupt);
  if (!ours) return std::unexpected(ours.error());
  auto theirs = runCyclictest(setting, interrupt);
  if (!theirs) return std::unexpected(theirs.error());
  if (!ours_first) ours = runForceLoop(setting, interrupt);
  if (!ours) return std::unexpected(ours.error());
  return JitterRound{std::move(*ours), std::move(*theirs)};
}

/// Waits until the workers of the load are running.
void settle(const Interrupt& interrupt) {
  for (int i = 0; i < 20 && !interrupt.requested(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
}

config::Result<LoadJitter> measureLoad(const std::string& load, const JitterOptions& options,
                                       const Interrupt& interrupt,
                                       const std::function<void(const std::string&)>& progress) {
  const LoopSetting setting{options.cpu, options.priority, options.period_us,
                            static_cast<std::uint64_t>(options.seconds) * 1'000'000 /
                                static_cast<std::uint64_t>(options.period_us)};
  std::optional<ChildProcess> stress;
  if (load == "stress") {
    auto started = ChildProcess::start(stressCommand(usableCpus(), options.cpu), {}, "apt install stress-ng");
    if (!started) return std::unexpected(started.error());
    stress.emplace(std::move(*started));
    settle(interrupt);
  }
  LoadJitter result{load, {}};
  for (int round = 0; round < options.rounds; ++round) {
    progress(fmt::format("{}, round {} of {}", load, round + 1, options.rounds));
    auto measured = measureRound(setting, interrupt, round % 2 == 0);
    if (!measured) return std::unexpected(measured.error());
    result.rounds.push_back(std::move(*measured));
    if (stress && stress->ending()) {
      return std::unexpected(config::Error{"stress-ng", "ended early: " + stress->ending()->text(),
                                           "does it run by itself, with memory to spare?"});
    }
  }
  return result;
}

}  // namespace

LoopRun LoadJitter::ours() const {
  LoopRun sum;
  for (const auto& [run, theirs] : rounds) {
    sum.wakeups.add(run.wakeups);
    sum.last_hop.add(run.last_hop);
    sum.overruns += run.overruns;
    sum.lost_ticks += run.lost_ticks;
    sum.contact_ticks += run.contact_ticks;
    sum.longest_tick_ns = std::max(sum.longest_tick_ns, run.longest_tick_ns);
  }
  return sum;
}

WakeupCounts LoadJitter::theirs() const {
  WakeupCounts sum;
  for (const JitterRound& round : rounds) sum.add(round.theirs);
  return sum;
}

double LoadJitter::ratio() const {
  return latencyRatio(ours().wakeups.quantile_us(0.999), theirs().quantile_us(0.999));
}

std::vector<double> LoadJitter::sortedRatios() const {
  std::vector<double> ratios;
  for (const JitterRound& round : rounds) ratios.push_back(round.ratio());
  std::ranges::sort(ratios);
  return ratios;
}

config::Result<JitterResult> measureJitter(const JitterOptions& options, const Interrupt& interrupt,
                                           const std::function<void(const std::string&)>& progress) {
  const auto cpu = cpuOf(options.cpu);
  if (!cpu) return std::unexpected(cpu.error());
  if (auto permitted = checkPermission(options.priority); !permitted)
    return std::unexpected(permitted.error());
  JitterResult result{.options = options, .loads = {}};
  result.options.cpu = *cpu;
  result.memory_locked = rt::lockMemory();
  const drivers::IdleLatencyLimit idle_latency;
  result.idle_limited = idle_latency.held();
  for (const std::string& load : options.loads) {
    auto measured = measureLoad(load, result.options, interrupt, progress);
    if (!measured) return std::unexpected(measured.error());
    result.loads.push_back(std::move(*measured));
  }
  return result;
}

}  // namespace hapticd::tools
