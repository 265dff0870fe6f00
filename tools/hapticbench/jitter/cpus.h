// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace hapticd::tools {

/// The CPUs that this process may use, in order.
std::vector<int> usableCpus();

/// Those of `usable_cpus` beside `measured_cpu`; that one when there is no other.
std::vector<int> otherCpus(const std::vector<int>& usable_cpus, int measured_cpu);

/// For its life, the calling thread and those that it starts stay on `cpus`, as far as that is permitted.
/// Thread: made and gone in the same one.
class KeptToCpus {
 public:
  explicit KeptToCpus(const std::vector<int>& cpus);
  ~KeptToCpus();
  KeptToCpus(const KeptToCpus&) = delete;
  KeptToCpus& operator=(const KeptToCpus&) = delete;

 private:
  std::vector<int> before_;
};

/// The command line of stress-ng: arithmetic and memory on all `usable_cpus` but `measured_cpu`; on that one
/// too when there is no other.
std::vector<std::string> stressCommand(const std::vector<int>& usable_cpus, int measured_cpu);

}  // namespace hapticd::tools
