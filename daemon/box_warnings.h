// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "config/settings/settings.h"
#include "daemon/base/box.h"
#include "drivers/base/cpus.h"
#include "rt/base/parameters.h"
#include "rt/loop/loop_state.h"

namespace hapticd::daemon {

/// The last CPU that the kernel keeps free of other tasks (isolcpus=), or -1 when there is none.
/// `file`: a list of CPUs as the kernel writes it ("2-3,5").
int lastIsolatedCpu(const std::filesystem::path& file = "/sys/devices/system/cpu/isolated");

/// Whether `file`, a list of CPUs as above, names `cpu`.
bool isIsolated(int cpu, const std::filesystem::path& file = "/sys/devices/system/cpu/isolated");

/// The number of page faults, minor and major, of a thread of this process since the thread started (proc(5),
/// `stat`). Nothing if there is no such thread or no /proc.
std::optional<std::uint64_t> pageFaultsOf(pid_t thread_id);

/// How late the force loop was within the last minute.
struct Lateness {
  bool late = false;  ///< so late that a person should look
  std::uint64_t ticks = 0;
  std::uint64_t late_ticks = 0;       ///< of these, that ended late
  std::uint64_t skipped_periods = 0;  ///< periods without a tick, in which the handle held a stale force
};

/// Judges whether the force loop keeps time. What is longer ago than a minute no longer counts, so that a
/// warning about it ends.
/// Thread: one at a time.
class LatenessWatch {
 public:
  /// To be called several times a second. `time_ns`: CLOCK_MONOTONIC, not earlier than in the last call.
  void follow(const rt::LoopCounters& counters, std::int64_t time_ns);
  const Lateness& lateness() const { return lateness_; }

 private:
  struct Sample {
    std::int64_t time_ns;
    std::uint64_t ticks;
    std::uint64_t late_ticks;
    std::uint64_t skipped_periods;
  };
  void judge();

  std::deque<Sample> samples_;  // one a second, oldest first
  Lateness lateness_;
};

/// What the warnings depend on, in addition to the status.
struct WarningSources {
  const config::Settings& settings;
  const rt::LiveParameters& live;        ///< in effect in the force loop
  const rt::LoopPrivileges& privileges;  ///< of the force thread
  bool cpus_may_sleep;   ///< the loop runs, and the CPUs are not kept out of deep sleep states
  bool cpu_is_isolated;  ///< the kernel keeps other tasks off the CPU of the force thread
  const Lateness& lateness;
  std::optional<drivers::CpuQuota> cpu_quota;  ///< that has paused threads of the daemon since its start
};

/// Returns the warnings about the running box, each with a remedy that needs no other tool to be found: a
/// fault, devices, the stiffness, a late force loop, traces, privileges and the model's capacity.
/// `status.warnings` and `status.loop.privileges` are not read.
std::vector<std::string> warningsOf(const BoxStatus& status, const WarningSources& sources);

}  // namespace hapticd::daemon
