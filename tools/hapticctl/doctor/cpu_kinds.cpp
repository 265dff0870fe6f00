// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/doctor/cpu_kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace hapticd::tools {

CpuKinds readCpuKinds(const Machine& machine, const CpuSet& online) {
  static constexpr std::array kMeasures{"cpu_capacity", "cpufreq/cpuinfo_max_freq"};
  for (const std::string file : kMeasures) {
    CpuKinds kinds{{}, file.substr(file.find('/') + 1)};
    for (const int cpu : online) {
      const auto speed = machine.readNumber(fmt::format("sys/devices/system/cpu/cpu{}/{}", cpu, file));
      if (speed && *speed > 0) kinds.speed[cpu] = *speed;
    }
    if (kinds.speed.size() == online.size()) return kinds;
  }
  return {};
}

CpuSet bigCpus(const CpuKinds& kinds, const CpuSet& online) {
  CpuSet cpus = online;
  cpus.erase(0);
  if (kinds.speed.empty()) return cpus;
  std::int64_t most = 0;
  for (const int cpu : cpus) most = std::max(most, kinds.speed.at(cpu));
  std::erase_if(cpus, [&](int cpu) { return kinds.speed.at(cpu) * 10 < most * 9; });
  return cpus;
}

}  // namespace hapticd::tools
