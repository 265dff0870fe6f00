// SPDX-License-Identifier: Apache-2.0
#include "daemon/realtime_conditions.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>

#include "drivers/base/cpu_list.h"

namespace hapticd::daemon {
namespace {

drivers::CpuSet isolatedCpus(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string list;
  std::getline(stream, list);
  return drivers::parseCpuList(list).value_or(drivers::CpuSet{});
}

}  // namespace

int lastIsolatedCpu(const std::filesystem::path& file) {
  const drivers::CpuSet cpus = isolatedCpus(file);
  return cpus.empty() ? -1 : *cpus.rbegin();
}

bool isIsolated(int cpu, const std::filesystem::path& file) {
  return isolatedCpus(file).contains(cpu);
}

std::optional<std::uint64_t> pageFaultsOf(pid_t thread_id) {
  std::ifstream file(fmt::format("/proc/self/task/{}/stat", thread_id));
  std::string line;
  if (!std::getline(file, line)) return std::nullopt;
  // The second field, the thread's name, is in parentheses and may contain any character.
  std::istringstream fields(line.substr(line.rfind(')') + 1));
  std::string skipped;
  for (int field = 3; field < 10; ++field) fields >> skipped;
  std::uint64_t minor = 0;
  std::uint64_t minor_of_children = 0;
  std::uint64_t major = 0;
  if (!(fields >> minor >> minor_of_children >> major)) return std::nullopt;
  return minor + major;
}

namespace {

constexpr std::int64_t kSamplePeriod_ns = 1'000'000'000;
constexpr std::int64_t kWindow_ns = 60 * kSamplePeriod_ns;

// One late tick in 10 000 is one every ten seconds at 1 kHz, which a hand hardly ever meets while in contact.
constexpr double kLateShare = 1e-4;
/// Up to this many late ticks do not count: they are from the start, when memory and caches are cold.
constexpr std::uint64_t kFewLateTicks = 3;
// Half a percent of a second without ticks, 5 of 1000, is no rounding.
constexpr double kSkippedShare = 0.005;

double share(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

void LatenessWatch::follow(const rt::LoopCounters& counters, std::int64_t time_ns) {
  if (!samples_.empty() && time_ns - samples_.back().time_ns < kSamplePeriod_ns) return;
  samples_.push_back({time_ns, counters.ticks, counters.overruns, counters.skipped_periods});
  while (samples_.size() > 2 && time_ns - samples_[1].time_ns >= kWindow_ns) samples_.pop_front();
  judge();
}

void LatenessWatch::judge() {
  const Sample& first = samples_.front();
  const Sample& last = samples_.back();
  lateness_ = {false, last.ticks - first.ticks, last.late_ticks - first.late_ticks,
               last.skipped_periods - first.skipped_periods};
  const auto skips = [](const Sample& before, const Sample& after) {
    const std::uint64_t skipped = after.skipped_periods - before.skipped_periods;
    return share(skipped, after.ticks - before.ticks + skipped) > kSkippedShare;
  };
  const bool ends_late =
      lateness_.late_ticks > kFewLateTicks && share(lateness_.late_ticks, lateness_.ticks) > kLateShare;
  lateness_.late = ends_late || std::ranges::adjacent_find(samples_, skips) != samples_.end();
}

}  // namespace hapticd::daemon
