// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/jitter/cpus.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sched.h>

#include <cstddef>

namespace hapticd::tools {
namespace {

void keepTo(const std::vector<int>& cpus) {
  cpu_set_t set;
  CPU_ZERO(&set);
  for (const int cpu : cpus) CPU_SET(static_cast<std::size_t>(cpu), &set);
  ::sched_setaffinity(0, sizeof set, &set);
}

}  // namespace

std::vector<int> usableCpus() {
  std::vector<int> cpus;
  cpu_set_t set;
  if (::sched_getaffinity(0, sizeof set, &set) != 0) return cpus;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(static_cast<std::size_t>(cpu), &set)) cpus.push_back(cpu);
  }
  return cpus;
}

std::vector<int> otherCpus(const std::vector<int>& usable_cpus, int measured_cpu) {
  std::vector<int> others = usable_cpus;
  std::erase(others, measured_cpu);
  return others.empty() ? std::vector<int>{measured_cpu} : others;
}

KeptToCpus::KeptToCpus(const std::vector<int>& cpus) : before_(usableCpus()) {
  keepTo(cpus);
}

KeptToCpus::~KeptToCpus() {
  keepTo(before_);
}

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

}  // namespace hapticd::tools
