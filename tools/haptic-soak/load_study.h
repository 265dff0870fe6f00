// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "config/error.h"
#include "tools/haptic-soak/soak_run.h"
#include "tools/lib/child/interrupt.h"

namespace hapticd::tools {

/// A load on the daemon.
enum class Load {
  none,       ///< one stream, which measures
  hammering,  ///< as many clients as requested, each asking for the status again and again without a pause
  tracing,    ///< a trace is written, and each of these clients watches at 20 ms
};
inline constexpr std::size_t kLoads = 3;
const char* nameOf(Load load);

struct LoadOptions {
  SoakOptions soak;  ///< daemon, configuration and assignments; the other members are not used
  int clients = 30;
  double round_s = 10;  ///< 1..60
  int rounds = 4;       ///< of each load; they take turns
};

/// Percentiles over one round's ticks, microseconds.
struct LoadRound {
  Load load = Load::none;
  std::uint64_t ticks = 0;
  double wakeup_p50_us = 0;
  double wakeup_p99_us = 0;
  double wakeup_p999_us = 0;
  double wakeup_max_us = 0;
  double compute_p99_us = 0;
};

struct LoadResult {
  std::vector<LoadRound> rounds;
  Json status;                   ///< GetStatus at the end
  std::uint64_t calls = 0;       ///< answered
  std::uint64_t unanswered = 0;  ///< or with something else than a status
  double trace_bytes_per_hour = 0;
};

/// Measures one daemon under alternating loads, so that other activities of the machine affect all of them
/// alike. Errors: hapticd does not start or does not answer; the trace cannot be begun.
config::Result<LoadResult> studyLoad(const LoadOptions& options, const Interrupt& interrupt,
                                     const std::function<void(double)>& progress);

/// Returns the result for people: medians over the rounds of each load, ratios to those of the first, what
/// was lost.
std::string loadTable(const LoadResult& result);
/// Returns the result as JSON.
std::string loadJson(const LoadResult& result);

}  // namespace hapticd::tools
