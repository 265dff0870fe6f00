// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "config/error.h"
#include "drivers/trace/trace_reader.h"
#include "tools/lib/trace/empty_periods.h"
#include "tools/lib/trace/trace_selection.h"

namespace hapticd::tools {

/// Spread of a duration, in microseconds. The percentiles are those of the whole trace, exact to the nearest
/// sample.
struct TraceDurations {
  double median_us = 0;
  double p99_us = 0;
  double p999_us = 0;
  double max_us = 0;
};

/// A run of missing ticks.
struct TraceGap {
  std::uint64_t after_tick = 0;  ///< number of the last tick before the gap
  std::uint64_t ticks = 0;       ///< number of missing ticks
  double time_s = 0;             ///< time of after_tick since the first tick
};

struct TraceSummary {
  drivers::TraceInfo info;
  double duration_s = 0;  ///< from the first to the last tick
  double rate_hz = 0;     ///< rate of the loop; ticks that are missing in the trace are included
  std::uint64_t gaps = 0;
  std::vector<TraceGap> first_gaps;  ///< at most 20
  EmptyPeriods empty_periods;
  double longest_empty_time_s = 0;  ///< when the longest run of empty periods began, since the first tick
  std::uint64_t overruns = 0;       ///< ticks whose predecessor ended late
  TraceDurations wakeup_latency;
  TraceDurations compute_time;
  double largest_force_n = 0;           ///< largest magnitude of the commanded force
  double largest_force_time_s = 0;      ///< its time since the first tick
  double contact_share = 0;             ///< share of the ticks in contact, 0..1
  std::uint64_t fixture_contacts = 0;   ///< how often a virtual fixture began to act
  double fixture_contact_share = 0;     ///< share of the ticks in which one acts, 0..1
  double largest_fixture_force_n = 0;   ///< largest magnitude of the force of forbidden regions
  double largest_guidance_force_n = 0;  ///< the same of guidance
  std::vector<std::pair<std::string, double>>
      modes_s;                                         ///< each mode that occurs, and its duration in seconds
  std::vector<std::pair<std::string, double>> laws_s;  ///< the same for each force law
  bool law_without_proxy =
      false;  ///< whether a law without a proxy occurs, which has neither contact state nor penetration
  std::string note;  ///< what somebody has noted about the trace, from the file beside it; empty: nothing
};

/// Reads the whole trace once.  Errors: those of readTrace().
/// Thread: any.  RT: not safe (keeps 16 bytes per tick).
config::Result<TraceSummary> summariseTrace(const std::filesystem::path& trace,
                                            const Progress& progress = {});

}  // namespace hapticd::tools
