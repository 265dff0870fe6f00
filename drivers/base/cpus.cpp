// SPDX-License-Identifier: Apache-2.0
#include "drivers/base/cpus.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <iterator>

namespace hapticd::drivers {
namespace {

constexpr int kLastCpu = 65535;

std::optional<int> cpuOf(std::string_view text) {
  int cpu = -1;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), cpu);
  const bool reads = error == std::errc() && end == text.data() + text.size();
  return reads && cpu >= 0 && cpu <= kLastCpu ? std::optional(cpu) : std::nullopt;
}

}  // namespace

std::optional<CpuSet> parseCpuList(std::string_view text) {
  CpuSet cpus;
  while (!text.empty()) {
    const std::size_t comma = std::min(text.find(','), text.size());
    const std::string_view range = text.substr(0, comma);
    const std::size_t dash = range.find('-');
    const auto first = cpuOf(range.substr(0, dash));
    const auto last = dash == std::string_view::npos ? first : cpuOf(range.substr(dash + 1));
    if (!first || !last || *first > *last) return std::nullopt;
    for (int cpu = *first; cpu <= *last; ++cpu) cpus.insert(cpu);
    text.remove_prefix(std::min(comma + 1, text.size()));
  }
  return cpus;
}

std::string cpuListText(const CpuSet& cpus) {
  std::string text;
  for (auto first = cpus.begin(); first != cpus.end();) {
    auto last = first;
    while (std::next(last) != cpus.end() && *std::next(last) == *last + 1) ++last;
    text += fmt::format("{}{}", text.empty() ? "" : ",", *first);
    if (last != first) text += fmt::format("-{}", *last);
    first = std::next(last);
  }
  return text;
}

CpuSet common(const CpuSet& a, const CpuSet& b) {
  CpuSet both;
  std::ranges::set_intersection(a, b, std::inserter(both, both.end()));
  return both;
}

namespace {

/// Reads what a folder of the control groups limits; nothing: nothing.
std::optional<CpuQuota> quotaIn(const std::filesystem::path& folder) {
  double quota_us = 0, period_us = 0;
  // version 2 has both in one file, with "max" where there is no limit; version 1 a negative number
  std::ifstream both(folder / "cpu.max");
  if (both.is_open()) {
    both >> quota_us >> period_us;
  } else {
    std::ifstream(folder / "cpu.cfs_quota_us") >> quota_us;
    std::ifstream(folder / "cpu.cfs_period_us") >> period_us;
  }
  if (quota_us <= 0 || period_us <= 0) return std::nullopt;
  CpuQuota quota{.cpus = quota_us / period_us};
  std::ifstream counters(folder / "cpu.stat");
  std::uint64_t count = 0;
  for (std::string name; counters >> name >> count;) {
    if (name == "nr_periods") quota.periods = count;
    if (name == "nr_throttled") quota.throttled = count;
  }
  return quota;
}

}  // namespace

std::optional<CpuQuota> cpuQuotaOf(const std::string& process, const std::filesystem::path& root) {
  std::optional<CpuQuota> narrowest;
  std::ifstream groups(root / "proc" / process / "cgroup");
  for (std::string line; std::getline(groups, line);) {  // "0::/docker/1f3a", "4:cpu,cpuacct:/docker/1f3a"
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",";
    const bool is_version_2 = controllers == ",,";
    if (!is_version_2 && controllers.find(",cpu,") == std::string::npos) continue;
    const std::filesystem::path folder = root / (is_version_2 ? "sys/fs/cgroup" : "sys/fs/cgroup/cpu");
    // a group has no more than the groups above it
    for (std::filesystem::path group = line.substr(second + 1);; group = group.parent_path()) {
      auto quota = quotaIn(folder / group.relative_path());
      if (quota && (!narrowest || quota->cpus < narrowest->cpus)) {
        quota->group = group.string();
        narrowest = std::move(quota);
      }
      if (!group.has_relative_path()) break;
    }
  }
  return narrowest;
}

std::string textOf(const CpuQuota& quota) {
  return fmt::format(
      "the control group {} has {:.2g} CPUs, and its processes were paused in {} of {} periods", quota.group,
      quota.cpus, quota.throttled, quota.periods);
}

}  // namespace hapticd::drivers
