// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "config/error.h"
#include "tools/hapticbench/jitter/wakeup_counts.h"
#include "tools/lib/child/interrupt.h"

namespace hapticd::tools {

/// Settings of both loops.
struct LoopSetting {
  int cpu = 0;
  int priority = 80;  ///< SCHED_FIFO
  std::int64_t period_us = 1000;
  std::uint64_t cycles = 10000;

  double length_s() const { return static_cast<double>(cycles) * static_cast<double>(period_us) * 1e-6; }
};

/// cyclictest's command line: its main thread on `other_cpus`, its histogram in `json_file`.
std::vector<std::string> cyclictestCommand(const LoopSetting& setting, const std::vector<int>& other_cpus,
                                           const std::string& json_file);

/// The histogram in what cyclictest wrote with --json. Wake-ups beyond the histogram's end count as the
/// latest. Errors: not JSON, not one thread's histogram, more wake-ups than cycles; `name` is of the file.
config::Result<WakeupCounts> parseCyclictest(const std::string& name, const std::string& text);

/// Runs cyclictest to its end. Errors: not installed, not permitted, interrupted.
config::Result<WakeupCounts> runCyclictest(const LoopSetting& setting, const Interrupt& interrupt);

}  // namespace hapticd::tools
