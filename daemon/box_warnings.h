// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/settings.h"
#include "daemon/base/box.h"
#include "rt/loop_state.h"
#include "rt/parameters.h"

namespace hapticd::daemon {

/// What warnings follow from, beside the status itself.
struct WarningSources {
  const config::Settings& settings;
  const rt::LiveParameters& live;        ///< that the force loop obeys
  const rt::LoopPrivileges& privileges;  ///< of the force thread
  bool cpus_may_sleep;  ///< the loop runs, and the CPUs are not kept out of deep sleep states
};

/// What is not as it should be in the running box, each with its remedy: devices, the stiffness, traces,
/// privileges and the model's capacity. `status.warnings` and `status.privileges` are not read.
std::vector<std::string> warningsOf(const BoxStatus& status, const WarningSources& sources);

}  // namespace hapticd::daemon
