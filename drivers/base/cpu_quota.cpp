// SPDX-License-Identifier: Apache-2.0
#include "drivers/base/cpu_quota.h"

#include <fmt/format.h>

#include <fstream>

namespace hapticd::drivers {
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
