// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sched.h>
#include <sysexits.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstddef>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "config/base/value_text.h"
#include "drivers/base/idle_latency.h"
#include "rt/base/realtime_thread.h"
#include "tools/hapticbench/engine/sequences.h"
#include "tools/hapticbench/engine/study.h"
#include "tools/hapticbench/jitter.h"
#include "tools/lib/child/child_process.h"

namespace hapticd::tools {

void WakeupCounts::addLatency(std::int64_t latency_ns) {
  constexpr std::int64_t kNsPerUs = 1000;
  add(std::max<std::int64_t>(latency_ns, 0) / kNsPerUs, 1);
}

void WakeupCounts::add(std::int64_t latency_us, std::uint64_t wakeups) {
  if (wakeups == 0) return;
  counts_[latency_us] += wakeups;
  total_ += wakeups;
}

void WakeupCounts::add(const WakeupCounts& others) {
  for (const auto& [latency_us, wakeups] : others.counts_) add(latency_us, wakeups);
}

std::int64_t WakeupCounts::quantile_us(double share) const {
  const double rank = share * static_cast<double>(total_);
  std::uint64_t not_above = 0;
  for (const auto& [latency_us, wakeups] : counts_) {
    not_above += wakeups;
    if (static_cast<double>(not_above) >= rank) return latency_us;
  }
  return max_us();
}

double latencyRatio(std::int64_t ours_us, std::int64_t theirs_us) {
  return static_cast<double>(std::max<std::int64_t>(ours_us, 1)) /
         static_cast<double>(std::max<std::int64_t>(theirs_us, 1));
}

namespace {

void keepTo(const std::vector<int>& cpus) {
  cpu_set_t set;
  CPU_ZERO(&set);
  for (const int cpu : cpus) CPU_SET(static_cast<std::size_t>(cpu), &set);
  ::sched_setaffinity(0, sizeof set, &set);
}

}  // namespace

std::vector<int> usableCpus() {
  std::vector<int> cpus;
  cpu_set_t set;
  if (::sched_getaffinity(0, sizeof set, &set) != 0) return cpus;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(static_cast<std::size_t>(cpu), &set)) cpus.push_back(cpu);
  }
  return cpus;
}

std::vector<int> otherCpus(const std::vector<int>& usable_cpus, int measured_cpu) {
  std::vector<int> others = usable_cpus;
  std::erase(others, measured_cpu);
  return others.empty() ? std::vector<int>{measured_cpu} : others;
}

KeptToCpus::KeptToCpus(const std::vector<int>& cpus) : before_(usableCpus()) {
  keepTo(cpus);
}

KeptToCpus::~KeptToCpus() {
  keepTo(before_);
}

std::vector<std::string> stressCommand(const std::vector<int>& usable_cpus, int measured_cpu) {
  const std::vector<int> others = otherCpus(usable_cpus, measured_cpu);
  return {"stress-ng",
          "--quiet",
          fmt::format("--cpu={}", others.size()),
          fmt::format("--vm={}", others.size()),
          "--vm-bytes=64m",
          "--timeout=0",
          fmt::format("--taskset={}", fmt::join(others, ","))};
}

namespace {

using nlohmann::json;

/// Longer than any wake-up latency of a usable machine.
constexpr int kHistogramEnd_us = 100'000;
constexpr const char* kInstall = "apt install rt-tests";

std::unexpected<base::Error> refused(const std::string& name, const std::string& what) {
  return std::unexpected(
      base::Error{name, what, "it is to be what cyclictest 2 writes with --json and --histogram"});
}

/// An object at `key`, null when there is none.
const json* objectAt(const json& parent, const char* key) {
  const auto found = parent.find(key);
  return found != parent.end() && found->is_object() ? &*found : nullptr;
}

std::optional<std::uint64_t> countAt(const json& parent, const char* key) {
  const auto found = parent.find(key);
  if (found == parent.end() || !found->is_number_unsigned()) return std::nullopt;
  return found->get<std::uint64_t>();
}

std::optional<std::int64_t> latencyOf(const std::string& key) {
  std::int64_t latency_us = 0;
  const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), latency_us);
  if (error != std::errc() || end != key.data() + key.size() || latency_us < 0) return std::nullopt;
  return latency_us;
}

/// Waits for the end of the program, for at most several times its expected duration.
base::Result<void> finish(ChildProcess& child, const LoopSetting& setting, const Interrupt& interrupt) {
  constexpr std::chrono::milliseconds kLook{50};
  const auto deadline =
      std::chrono::steady_clock::now() + std::chrono::duration<double>(10 + 4 * setting.length_s());
  while (!child.waitFor(kLook)) {
    if (interrupt.requested()) return std::unexpected(base::Error{"", "interrupted", ""});
    if (std::chrono::steady_clock::now() > deadline) {
      return std::unexpected(base::Error{"cyclictest", "does not end", "is the CPU of --cpu taken?"});
    }
  }
  const ChildEnding ending = *child.ending();
  if (ending.good()) return {};
  return std::unexpected(base::Error{"cyclictest", "failed: " + ending.text(),
                                     "it needs the right to SCHED_FIFO and to lock memory: run as root"});
}

}  // namespace

std::vector<std::string> cyclictestCommand(const LoopSetting& setting, const std::vector<int>& other_cpus,
                                           const std::string& json_file) {
  return {"cyclictest",
          "--mlockall",
          "--quiet",
          "--threads=1",
          fmt::format("--affinity={}", setting.cpu),
          fmt::format("--mainaffinity={}", fmt::join(other_cpus, ",")),
          fmt::format("--priority={}", setting.priority),
          fmt::format("--interval={}", setting.period_us),
          fmt::format("--loops={}", setting.cycles),
          fmt::format("--histogram={}", kHistogramEnd_us),
          "--json=" + json_file};
}

base::Result<WakeupCounts> parseCyclictest(const std::string& name, const std::string& text) {
  const json document = json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!document.is_object()) return refused(name, "is not a JSON object");
  const json* threads = objectAt(document, "thread");
  if (threads == nullptr || threads->size() != 1)
    return refused(name, "does not hold exactly one \"thread\"");
  const json& thread = threads->front();
  const json* histogram = thread.is_object() ? objectAt(thread, "histogram") : nullptr;
  if (histogram == nullptr) return refused(name, "its thread has no \"histogram\"");
  const auto cycles = countAt(thread, "cycles");
  const auto max_us = countAt(thread, "max");
  if (!cycles || !max_us) return refused(name, "its thread lacks \"cycles\" or \"max\"");

  WakeupCounts counts;
  for (const auto& [key, count] : histogram->items()) {
    const auto latency_us = latencyOf(key);
    if (!latency_us || !count.is_number_unsigned()) {
      return refused(name,
                     fmt::format("{} in its histogram is not a latency with a count", base::inQuotes(key)));
    }
    counts.add(*latency_us, count.get<std::uint64_t>());
  }
  if (counts.total() > *cycles) {
    return refused(name, fmt::format("its histogram holds {} wake-ups of {}", counts.total(), *cycles));
  }
  counts.add(static_cast<std::int64_t>(*max_us), *cycles - counts.total());
  return counts;
}

base::Result<WakeupCounts> runCyclictest(const LoopSetting& setting, const Interrupt& interrupt) {
  const TemporaryFolder folder;
  const std::string report = (folder.path() / "cyclictest.json").string();
  auto child = ChildProcess::start(cyclictestCommand(setting, otherCpus(usableCpus(), setting.cpu), report),
                                   {}, kInstall);
  if (!child) return std::unexpected(child.error());
  if (auto finished = finish(*child, setting, interrupt); !finished) return std::unexpected(finished.error());
  std::ifstream file(report);
  return parseCyclictest(report, {std::istreambuf_iterator<char>(file), {}});
}

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

/// `load`, `loop`: what a line of the table is of.
Row latencyCells(const std::string& load, const char* loop, const WakeupCounts& counts) {
  return {{"", "load", 0, load},
          {"", "loop", 0, loop},
          {"", "wake-ups", 0, counts.total()},
          {"/p50_us", "p50", 0, counts.quantile_us(0.5)},
          {"/p99_us", "p99", 0, counts.quantile_us(0.99)},
          {"/p999_us", "p99.9", 0, counts.quantile_us(0.999)},
          {"/max_us", "max", 0, counts.max_us()}};
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

nlohmann::ordered_json countsJson(const WakeupCounts& counts, const char* counted) {
  nlohmann::ordered_json object{{counted, counts.total()}};
  for (const Cell& cell : latencyCells("", "", counts)) {
    if (!cell.key.empty()) cell.figure.write([&]() -> auto& { return object[cell.key.substr(1)]; });
  }
  auto& histogram = object["histogram_us"] = nlohmann::ordered_json::object();
  for (const auto& [latency_us, wakeups] : counts.counts()) histogram[std::to_string(latency_us)] = wakeups;
  return object;
}

nlohmann::ordered_json loadJson(const LoadJitter& load) {
  const LoopRun ours = load.ours();
  nlohmann::ordered_json hapticd = countsJson(ours.wakeups, "wakeups");
  hapticd.update({{"overruns", ours.overruns},
                  {"lost_ticks", ours.lost_ticks},
                  {"contact_ticks", ours.contact_ticks},
                  {"longest_tick_ns", ours.longest_tick_ns}});
  auto ratios = nlohmann::ordered_json::array();
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
  std::vector<Row> rows;
  for (const LoadJitter& load : result.loads) {
    rows.push_back(latencyCells(load.load, "hapticd", load.ours().wakeups));
    rows.push_back(latencyCells(load.load, "cyclictest", load.theirs()));
    rows.push_back(latencyCells(load.load, "last hop", load.ours().last_hop));
  }
  report.show("wake-up latency", "\n", std::move(rows));
  for (const LoadJitter& load : result.loads) report.say(loadText(load));
  report.note("/cpu", options.cpu);
  report.note("/priority", options.priority);
  report.note("/period_us", options.period_us);
  report.note("/rounds", options.rounds);
  report.note("/phase_s", options.seconds);
  report.note("/memory_locked", result.memory_locked);
  report.note("/idle_limited", result.idle_limited);
  auto& loads = report.document()["loads"] = nlohmann::ordered_json::array();
  for (const LoadJitter& load : result.loads) loads.push_back(loadJson(load));
  return report;
}

StudyCommand jitterCommand(CLI::App& app) {
  const auto options = std::make_shared<JitterOptions>();
  StudyCommand command(app, "jitter",
                       "wake-up latency of hapticd's loop compared with cyclictest, in one run");
  command.number("--seconds", options->seconds, 1, 86400, "length of each phase (2)");
  command.number("--rounds", options->rounds, 1, 1000, "phases of each loop and load (30)");
  command.names("--loads", options->loads, {"idle", "stress"}, "both");
  command.number("--cpu", options->cpu, -1, 1023, "CPU of both loops (the last one)");
  command.number("--priority", options->priority, 1, 98, "SCHED_FIFO priority of both loops (80)");
  command.number("--period-us", options->period_us, 500, 10000, "period of both loops (1000)");
  command.footer(
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
