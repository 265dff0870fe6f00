// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/error.h"
#include "tools/child/child_process.h"

namespace hapticd::tools {

/// stress-ng's command line: arithmetic and memory on all `usable_cpus` but `measured_cpu`; on that one too
/// when there is no other.
std::vector<std::string> stressCommand(const std::vector<int>& usable_cpus, int measured_cpu);

/// Starts it; it runs until the object goes. Errors: not installed.
config::Result<ChildProcess> startLoad(int measured_cpu);

}  // namespace hapticd::tools
