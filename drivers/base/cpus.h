// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>

namespace hapticd::drivers {

using CpuSet = std::set<int>;

/// Parses a list of CPUs in the kernel's form ("0-2,5"; "" for none); nothing if the text does not have that
/// form or names a CPU above 65535.
std::optional<CpuSet> parseCpuList(std::string_view text);

/// Formats a list of CPUs in the kernel's form: "0-2,5".
std::string cpuListText(const CpuSet& cpus);

/// The CPUs that are in both lists.
CpuSet common(const CpuSet& a, const CpuSet& b);

/// How much CPU time a control group leaves to its processes, as of a container with a CPU limit. When it is
/// used up, they are paused until the next period of usually 100 ms; threads of real-time priority are not.
struct CpuQuota {
  std::string group = {};  ///< "/docker/1f3a"
  double cpus = 0;         ///< CPU time for each time
  std::uint64_t periods = 0;
  std::uint64_t throttled = 0;  ///< periods in which something was paused
};

/// The narrowest quota of the control groups of a process, of either version. `process`: its number, or
/// "self". `root`: stands for "/". Nothing: there is none.
std::optional<CpuQuota> cpuQuotaOf(const std::string& process, const std::filesystem::path& root = "/");

/// "the control group /docker/1f3a has 0.15 CPUs, and its processes were paused in 59 of 60 periods".
std::string textOf(const CpuQuota& quota);
inline constexpr const char* kRaiseCpuQuota =
    "raise the CPU limit of the container or unit, --cpus or CPUQuota=, or remove it";

}  // namespace hapticd::drivers
