// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sched.h>
#include <stdlib.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstddef>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>

#include "config/base/value_text.h"
#include "tools/hapticbench/engine/sequences.h"
#include "tools/hapticbench/jitter/jitter.h"
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

}  // namespace hapticd::tools
