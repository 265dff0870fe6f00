// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

namespace hapticd::tools {

inline constexpr double kFramesPerSecond = 30;
inline constexpr double kTicksPerSecond = 1000;

/// How long each frame and each force of a run took, nanoseconds, in the order of the run.
struct CostSamples {
  std::vector<std::int64_t> model_ns;  ///< all modelling that a frame caused
  std::vector<std::int64_t> force_ns;

  /// Keeps the faster time of each sample of two equal runs, which leaves out interruptions by other
  /// programs.
  void keepLeast(const CostSamples& again);
  void append(const CostSamples& more);
};

/// CPU cost of a law, microseconds of one core. All 0 where nothing was measured.
struct CpuCost {
  double model_median_us = 0;
  double model_mean_us = 0;
  double model_max_us = 0;
  double force_median_us = 0;
  double force_mean_us = 0;
  double force_p999_us = 0;
  double force_max_us = 0;

  static CpuCost of(const CostSamples& samples);
  /// Milliseconds of CPU time per second of use: 30 frames modelled and 1000 forces.
  double cpu_ms_per_s() const {
    return (kFramesPerSecond * model_mean_us + kTicksPerSecond * force_mean_us) / 1000;
  }
};

/// The time that the clock measures for an empty call: its own cost, nanoseconds.
std::int64_t clockCost_ns();

}  // namespace hapticd::tools
