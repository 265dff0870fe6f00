// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/settings/settings.h"
#include "daemon/base/box.h"
#include "daemon/realtime_conditions.h"
#include "drivers/base/cpu_quota.h"
#include "rt/base/parameters.h"
#include "rt/loop/loop_state.h"

namespace hapticd::daemon {

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
