// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace hapticd::tools {

/// The resources that a process holds at one moment.
struct ProcessSample {
  double time_s = 0;  ///< since the soak began
  std::uint64_t resident_kb = 0;
  std::uint64_t descriptors = 0;
  std::uint64_t threads = 0;
  std::uint64_t force_thread_faults = 0;  ///< minor and major, since that thread's start; 0: no such thread
};

/// Samples process `pid`; returns nothing if it does not exist any more. `time_s` is left at 0.
/// `proc`: where the kernel shows processes.
std::optional<ProcessSample> sampleProcess(pid_t pid, const std::filesystem::path& proc = "/proc");

/// Minor and major faults in a line of /proc/PID/task/TID/stat; nothing when it is no such line.
std::optional<std::uint64_t> faultsIn(const std::string& stat_line);

}  // namespace hapticd::tools
