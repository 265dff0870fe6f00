// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "drivers/base/cpu_list.h"
#include "tools/hapticctl/doctor/machine.h"

namespace hapticd::tools {

using drivers::CpuSet;

/// How fast each CPU of a machine is, for boards that have big and little ones.
struct CpuKinds {
  std::map<int, std::int64_t> speed;  ///< by CPU; empty where it is not known of every CPU
  std::string measure;                ///< "cpu_capacity" or "cpuinfo_max_freq"
};

/// Reads the capacity of each CPU, which ARM kernels state, or its largest frequency.
CpuKinds readCpuKinds(const Machine& machine, const CpuSet& online);

/// The CPUs with at least nine tenths of the speed of the fastest: CPUs of one kind may differ by a few per
/// cent. CPU 0 is left out, because it cannot be kept free. All CPUs but 0 where their speeds are not known.
/// hapticd-realtime-setup chooses among the same CPUs.
CpuSet bigCpus(const CpuKinds& kinds, const CpuSet& online);

}  // namespace hapticd::tools
