// SPDX-License-Identifier: Apache-2.0
#include "daemon/isolated_cpu.h"

#include <fstream>
#include <string>

#include "drivers/base/cpu_list.h"

namespace hapticd::daemon {
namespace {

drivers::CpuSet isolatedCpus(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string list;
  std::getline(stream, list);
  return drivers::parseCpuList(list).value_or(drivers::CpuSet{});
}

}  // namespace

int lastIsolatedCpu(const std::filesystem::path& file) {
  const drivers::CpuSet cpus = isolatedCpus(file);
  return cpus.empty() ? -1 : *cpus.rbegin();
}

bool isIsolated(int cpu, const std::filesystem::path& file) {
  return isolatedCpus(file).contains(cpu);
}

}  // namespace hapticd::daemon
