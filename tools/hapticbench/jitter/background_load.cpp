// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/jitter/background_load.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "tools/hapticbench/jitter/cpus.h"

namespace hapticd::tools {

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

config::Result<ChildProcess> startLoad(int measured_cpu) {
  return ChildProcess::start(stressCommand(usableCpus(), measured_cpu), {}, "apt install stress-ng");
}

}  // namespace hapticd::tools
