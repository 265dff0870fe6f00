// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "config/error.h"
#include "tools/hapticbench/jitter/loop_run.h"
#include "tools/lib/child/interrupt.h"

namespace hapticd::tools {

/// Largest allowed ratio of the p99.9 wake-up latency of hapticd's loop to that of cyclictest.
inline constexpr double kMostLatencyRatio = 1.25;

struct JitterOptions {
  int seconds = 2;  ///< of each phase
  int rounds = 30;
  int cpu = -1;  ///< -1: the last one that this process may use
  int priority = 80;
  int period_us = 1000;
  std::vector<std::string> loads{"idle", "stress"};
};

/// One phase of hapticd's loop and one of cyclictest, next to each other in time.
struct JitterRound {
  LoopRun ours;
  WakeupCounts theirs;

  double ratio() const { return latencyRatio(ours.wakeups.quantile_us(0.999), theirs.quantile_us(0.999)); }
};

struct LoadJitter {
  std::string load;
  std::vector<JitterRound> rounds;

  LoopRun ours() const;         ///< of all rounds
  WakeupCounts theirs() const;  ///< of all rounds
  double ratio() const;         ///< of p99.9 over all rounds
  /// Ratios of the single rounds, in ascending order.
  std::vector<double> sortedRatios() const;
  bool kept() const { return ratio() <= kMostLatencyRatio; }
};

struct JitterResult {
  JitterOptions options;       ///< with the CPU that it was
  bool memory_locked = false;  ///< of this process; cyclictest locks its own
  bool idle_limited = false;   ///< the CPU was kept out of sleep states that it is slow to leave
  std::vector<LoadJitter> loads;
};

/// Measures both loops in turn, each load for all its rounds; every second round begins with cyclictest, so
/// that a drift of the machine falls on both alike. The whole run holds /dev/cpu_dma_latency at 0, and locks
/// memory. `progress` is given what begins. Errors: a program or a permission is missing, a phase failed,
/// interrupted.
config::Result<JitterResult> measureJitter(const JitterOptions& options, const Interrupt& interrupt,
                                           const std::function<void(const std::string&)>& progress);

/// Percentiles of both loops and their ratio beside the limit, for people; with all histograms, for programs.
std::string jitterText(const JitterResult& result);
std::string jitterJson(const JitterResult& result);

}  // namespace hapticd::tools
