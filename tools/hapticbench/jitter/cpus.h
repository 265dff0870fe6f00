// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace hapticd::tools {

/// The CPUs that this process may use, in order.
std::vector<int> usableCpus();

/// Returns `usable_cpus` without `measured_cpu`, or only `measured_cpu` if there is no other.
std::vector<int> otherCpus(const std::vector<int>& usable_cpus, int measured_cpu);

/// While the object exists, the calling thread and threads that it starts stay on `cpus`, as far as
/// permitted. Thread: created and destroyed by the same one.
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
