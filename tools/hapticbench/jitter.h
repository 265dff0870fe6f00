// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "tools/hapticbench/engine/report.h"
#include "tools/lib/child/child_process.h"

namespace hapticd::tools {

/// Number of wake-ups by their latency in whole microseconds, rounded down as cyclictest does.
/// Thread: one at a time.  RT: not safe.
class WakeupCounts {
 public:
  /// An early wake-up counts as one in time.
  void addLatency(std::int64_t latency_ns);
  void add(std::int64_t latency_us, std::uint64_t wakeups);
  void add(const WakeupCounts& others);

  std::uint64_t total() const { return total_; }
  /// The largest, 0 while empty.
  std::int64_t max_us() const { return counts_.empty() ? 0 : counts_.rbegin()->first; }
  /// The smallest latency that at least this share (0..1) of the wake-ups did not exceed; 0 while empty.
  std::int64_t quantile_us(double share) const;
  /// Returns the number of wake-ups by latency in us; only latencies that occurred.
  const std::map<std::int64_t, std::uint64_t>& counts() const { return counts_; }

 private:
  std::map<std::int64_t, std::uint64_t> counts_;
  std::uint64_t total_ = 0;
};

/// Returns `ours` / `theirs`, both in whole microseconds; values below one count as one.
double latencyRatio(std::int64_t ours_us, std::int64_t theirs_us);

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
base::Result<WakeupCounts> parseCyclictest(const std::string& name, const std::string& text);

/// Runs cyclictest to its end. Errors: not installed, not permitted, interrupted.
base::Result<WakeupCounts> runCyclictest(const LoopSetting& setting, const Interrupt& interrupt);

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

/// Measurements of hapticd's loop in one phase.
struct LoopRun {
  WakeupCounts wakeups;
  /// From the writing of a command by the loop to its taking effect at the simulated handle.
  WakeupCounts last_hop;
  std::uint64_t overruns = 0;       ///< ticks that ended after the next one was due
  std::uint64_t lost_ticks = 0;     ///< not in `wakeups`, because the ring was full
  std::uint64_t contact_ticks = 0;  ///< ticks in contact
  std::int64_t longest_tick_ns = 0;
};

/// Runs the force loop as hapticd does, in a thread of its own over its real channels: a simulated hand
/// presses and strokes a wall, which is modelled 30 times a second, and every tick is taken out of the ring.
/// Errors: SCHED_FIFO or the CPU is refused, a thread cannot be started, the loop hardly ticks, interrupted.
base::Result<LoopRun> runForceLoop(const LoopSetting& setting, const Interrupt& interrupt);

/// Largest allowed ratio of the p99.9 wake-up latency of hapticd's loop to that of cyclictest.
inline constexpr double kMaxLatencyRatio = 1.25;

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
  bool met() const { return ratio() <= kMaxLatencyRatio; }
};

struct JitterResult {
  JitterOptions options;       ///< with the CPU that it was
  bool memory_locked = false;  ///< of this process; cyclictest locks its own
  bool idle_limited = false;   ///< the CPU was kept out of sleep states that it is slow to leave
  std::vector<LoadJitter> loads;
};

/// Measures both loops in turn, each load for all its rounds; every second round begins with cyclictest, so
/// that a drift of the machine falls on both alike. The whole run holds /dev/cpu_dma_latency at 0, and locks
/// memory. Errors: a program or a permission is missing, a phase failed,
/// interrupted.
base::Result<JitterResult> measureJitter(const JitterOptions& options, const Interrupt& interrupt);

/// Percentiles of both loops and their ratio beside the limit; for programs with all histograms.
Report jitterReport(const JitterResult& result);

}  // namespace hapticd::tools
