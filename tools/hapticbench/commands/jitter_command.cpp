// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sysexits.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>

#include "drivers/base/idle_latency.h"
#include "rt/base/realtime_thread.h"
#include "tools/hapticbench/engine/study.h"
#include "tools/hapticbench/jitter/jitter.h"
#include "tools/lib/child/child_process.h"

namespace hapticd::tools {
namespace {

base::Result<int> cpuOf(int requested) {
  const std::vector<int> usable = usableCpus();
  if (usable.empty()) return std::unexpected(base::Error{"--cpu", "no usable CPU is known", ""});
  if (requested < 0) return usable.back();
  if (std::ranges::find(usable, requested) != usable.end()) return requested;
  return std::unexpected(base::Error{"--cpu", fmt::format("{} is not one of this process", requested),
                                     fmt::format("allowed are {}", fmt::join(usable, ", "))});
}

/// Whether this process may have SCHED_FIFO, tried in a thread that ends at once.
base::Result<void> checkPermission(int priority) {
  bool permitted = false;
  std::thread([&] { permitted = rt::useRealtimeScheduling(priority); }).join();
  if (permitted) return {};
  return std::unexpected(base::Error{"SCHED_FIFO", fmt::format("priority {} is not permitted", priority),
                                     "run as root, or with an rtprio line in limits.conf"});
}

base::Result<JitterRound> measureRound(const LoopSetting& setting, const Interrupt& interrupt,
                                       bool ours_first) {
  base::Result<LoopRun> ours;
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

base::Result<LoadJitter> measureLoad(const std::string& load, const JitterOptions& options,
                                     const Interrupt& interrupt) {
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
    showProgress(fmt::format("{}, round {} of {}", load, round + 1, options.rounds));
    auto measured = measureRound(setting, interrupt, round % 2 == 0);
    if (!measured) return std::unexpected(measured.error());
    result.rounds.push_back(std::move(*measured));
    if (stress && stress->ending()) {
      return std::unexpected(base::Error{"stress-ng", "ended early: " + stress->ending()->text(),
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

base::Result<JitterResult> measureJitter(const JitterOptions& options, const Interrupt& interrupt) {
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
    auto measured = measureLoad(load, result.options, interrupt);
    if (!measured) return std::unexpected(measured.error());
    result.loads.push_back(std::move(*measured));
  }
  return result;
}

namespace {

/// The loop and load of one line of the table.
struct LoopRow {
  std::string load;
  std::string loop;
  WakeupCounts counts;
};

Columns<LoopRow> columns() {
  using Row = LoopRow;
  return {{"", "load", 0, &Row::load},
          {"", "loop", 0, &Row::loop},
          {"", "wake-ups", 0, [](const Row& r) { return r.counts.total(); }},
          {"/p50_us", "p50", 0, [](const Row& r) { return r.counts.quantile_us(0.5); }},
          {"/p99_us", "p99", 0, [](const Row& r) { return r.counts.quantile_us(0.99); }},
          {"/p999_us", "p99.9", 0, [](const Row& r) { return r.counts.quantile_us(0.999); }},
          {"/max_us", "max", 0, [](const Row& r) { return r.counts.max_us(); }}};
}

std::string loadText(const LoadJitter& load) {
  const LoopRun ours = load.ours();
  const std::vector<double> ratios = load.sortedRatios();
  std::string text = fmt::format(
      "\n{}: p99.9, hapticd by cyclictest: {:.2f}, at most {:.2f} ({})\n"
      "  in single rounds {:.2f} to {:.2f}, in half of them up to {:.2f}\n"
      "  overruns of hapticd {}, longest tick {:.1f} us, in contact {:.0f} %",
      load.load, load.ratio(), kMaxLatencyRatio, load.met() ? "met" : "not met", ratios.front(),
      ratios.back(), ratios[(ratios.size() - 1) / 2], ours.overruns,
      static_cast<double>(ours.longest_tick_ns) * 1e-3,
      100 * static_cast<double>(ours.contact_ticks) / static_cast<double>(ours.wakeups.total()));
  if (ours.lost_ticks != 0) text += fmt::format(", {} ticks lost because the ring was full", ours.lost_ticks);
  return text + "\n";
}

Json countsJson(const WakeupCounts& counts, const char* counted) {
  Json object{{counted, counts.total()}};
  object.update(tableJson(columns(), std::vector<LoopRow>{{"", "", counts}}).front());
  Json& histogram = object["histogram_us"] = Json::object();
  for (const auto& [latency_us, wakeups] : counts.counts()) histogram[std::to_string(latency_us)] = wakeups;
  return object;
}

Json loadJson(const LoadJitter& load) {
  const LoopRun ours = load.ours();
  Json hapticd = countsJson(ours.wakeups, "wakeups");
  hapticd.update({{"overruns", ours.overruns},
                  {"lost_ticks", ours.lost_ticks},
                  {"contact_ticks", ours.contact_ticks},
                  {"longest_tick_ns", ours.longest_tick_ns}});
  Json ratios = Json::array();
  for (const JitterRound& round : load.rounds) ratios.push_back(round.ratio());
  return {{"load", load.load},
          {"hapticd", std::move(hapticd)},
          {"cyclictest", countsJson(load.theirs(), "wakeups")},
          {"last_hop", countsJson(ours.last_hop, "commands")},
          {"ratio_p999", load.ratio()},
          {"ratio_limit", kMaxLatencyRatio},
          {"met", load.met()},
          {"round_ratios_p999", std::move(ratios)}};
}

}  // namespace

Report jitterReport(const JitterResult& result) {
  const JitterOptions& options = result.options;
  Report report;
  report.say(fmt::format(
      "Wake-up latency, us: CPU {}, SCHED_FIFO {}, period {} us, {} rounds of {} s each in turn\n",
      options.cpu, options.priority, options.period_us, options.rounds, options.seconds));
  if (!result.memory_locked) report.say("hapticd's memory is not locked (not permitted)\n");
  if (!result.idle_limited) report.say("CPUs may sleep deeply (/dev/cpu_dma_latency is not writable)\n");
  std::vector<LoopRow> rows;
  Json loads = Json::array();
  for (const LoadJitter& load : result.loads) {
    rows.push_back({load.load, "hapticd", load.ours().wakeups});
    rows.push_back({load.load, "cyclictest", load.theirs()});
    rows.push_back({load.load, "last hop", load.ours().last_hop});
    loads.push_back(loadJson(load));
  }
  report.show("wake-up latency", "\n", columns(), rows);
  for (const LoadJitter& load : result.loads) report.say(loadText(load));
  report.note("cpu", options.cpu);
  report.note("priority", options.priority);
  report.note("period_us", options.period_us);
  report.note("rounds", options.rounds);
  report.note("phase_s", options.seconds);
  report.note("memory_locked", result.memory_locked);
  report.note("idle_limited", result.idle_limited);
  report.note("loads", std::move(loads));
  return report;
}

StudyCommand jitterCommand(CLI::App& app) {
  const auto options = std::make_shared<JitterOptions>();
  StudyCommand command(app, "jitter",
                       "wake-up latency of hapticd's loop compared with cyclictest, in one run");
  command->add_option("--seconds", options->seconds, "length of each phase (2)")->check(within(1, 86400));
  command->add_option("--rounds", options->rounds, "phases of each loop and load (30)")
      ->check(within(1, 1000));
  command.names("--loads", options->loads, {"idle", "stress"}, "both");
  command->add_option("--cpu", options->cpu, "CPU of both loops (the last one)")->check(within(-1, 1023));
  command->add_option("--priority", options->priority, "SCHED_FIFO priority of both loops (80)")
      ->check(within(1, 98));
  command->add_option("--period-us", options->period_us, "period of both loops (1000)")
      ->check(within(500, 10000));
  command->footer(
      "The loops take turns on one CPU at one priority, each in a fresh thread or process whose other\n"
      "threads are kept off that CPU. stress-ng loads all other CPUs. Latencies are whole microseconds,\n"
      "rounded down. A run takes 2 x loads x rounds x seconds. Many short phases spread disturbances by\n"
      "other programs over both\n"
      "loops. Needs cyclictest (package rt-tests), stress-ng for the load, and the right to SCHED_FIFO.");
  command.onRun([options](const StudyCommand& self) {
    constexpr int kInterrupted = 130;  // as shells report it
    const Interrupt interrupt;
    const auto result = measureJitter(*options, interrupt);
    if (result) return self.report(jitterReport(*result));
    return fail(result.error(), interrupt.requested() ? kInterrupted : EX_UNAVAILABLE);
  });
  return command;
}

}  // namespace hapticd::tools
