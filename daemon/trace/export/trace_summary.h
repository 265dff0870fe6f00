// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/base/error.h"
#include "daemon/trace/export/selected_trace.h"
#include "daemon/trace/reader/trace_reader.h"
#include "rt/base/vec3.h"
#include "rt/loop/loop_state.h"

namespace hapticd::trace {

/// A stay of the HIP inside a forbidden region, from an event of the kind `breach`. What the event does not
/// have, because an older version wrote it, is not a number.
struct BreachEntry {
  static constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();

  std::string fixture;
  double time_s = kNotKnown;  ///< when the HIP entered, since the first record; negative: before the trace
  double duration_s = kNotKnown;
  double depth_m = kNotKnown;        ///< largest
  double entry_m_per_s = kNotKnown;  ///< speed of the HIP when it entered
  double speed_m_per_s = kNotKnown;  ///< largest
  double force_n = kNotKnown;        ///< largest that the fixture exerted
  rt::Vec3 entered_m_in_world{kNotKnown, kNotKnown, kNotKnown};
};

/// All breaches of one fixture.
struct FixtureBreaches {
  std::string fixture;
  std::uint64_t count = 0;
  double total_s = 0;
  double longest_s = 0;
  double deepest_m = 0;
  double fastest_entry_m_per_s = BreachEntry::kNotKnown;  ///< of those whose speed is known
  double largest_force_n = BreachEntry::kNotKnown;        ///< the same
};

struct BreachReport {
  TraceInfo info;
  /// The forbidden regions that hold the HIP off, in the order in which the trace first names them; also
  /// those without a breach.
  std::vector<FixtureBreaches> fixtures;
  std::vector<BreachEntry> breaches;  ///< in the order of their times
  bool lacks_speeds = false;          ///< a breach has no speeds and forces
};

/// Reads the breaches of a trace. One that had not ended when the trace was stopped, or whose end is within
/// the last half second, is not in it.
/// Errors: those of readTrace(), or the trace has no channel of events.
/// Thread: any.
base::Result<BreachReport> breachesIn(const std::filesystem::path& trace, const Progress& progress = {});

/// A parameter in the settings of a trace.
struct TraceSetting {
  std::string name;   ///< "force.radius_m"
  std::string value;  ///< as it is written in the settings
  bool text = false;  ///< whether it is in quotes, so that it is a text even if it looks like a number
};

/// The file settings.yaml in the trace: the whole configuration at its beginning, in the form of hapticd's
/// own file. Empty if the trace has none.
std::string_view settingsText(const TraceInfo& trace);

/// The parameters in such a file, in its order; what does not have the form `group: {name: value}` is left
/// out.
std::vector<TraceSetting> settingsIn(std::string_view text);

/// The value as a number, with 1 and 0 for true and false; nothing if it is a text.
std::optional<double> numberIn(std::string_view value);

/// The period of the force loop in the settings, in nanoseconds; nothing if they do not contain it.
std::optional<std::int64_t> periodIn(const TraceInfo& trace);

/// Periods of the force loop in which no tick began, because the previous tick ended too late. They do not
/// count in the numbers of the ticks, so only the planned times show them.
struct EmptyPeriods {
  std::int64_t period_ns = 0;    ///< 0: unknown, because there are fewer than two ticks
  std::uint64_t periods = 0;     ///< from the first to the last tick, both included
  std::uint64_t empty = 0;       ///< periods without a tick, not counting ticks that the trace lacks
  std::uint64_t stretches = 0;   ///< number of runs of empty periods
  std::uint64_t longest = 0;     ///< length of the longest run, in periods
  std::uint64_t after_tick = 0;  ///< number of the tick before it
  std::int64_t after_ns = 0;     ///< planned time of that tick
};

/// Finds the empty periods of a trace.  Thread: one.
class EmptyPeriodCount {
 public:
  /// Adds a tick; ticks must be added in the order of time.
  void add(const rt::Tick& tick);
  /// Returns the result. period_ns: period of the loop; nothing: take the shortest time between two ticks.
  EmptyPeriods finish(std::optional<std::int64_t> period_ns) const;

 private:
  /// Equal steps from one tick to the next; there are few different ones.
  struct Steps {
    std::uint64_t count = 0;
    std::uint64_t after_tick = 0;  ///< the tick before the first such step
    std::int64_t after_ns = 0;
  };
  /// Keyed by the difference of the planned times, in nanoseconds, and of the numbers of the ticks.
  std::map<std::pair<std::int64_t, std::uint64_t>, Steps> steps_;
  std::optional<std::pair<std::int64_t, std::uint64_t>> last_;
};

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
  TraceInfo info;
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
base::Result<TraceSummary> summariseTrace(const std::filesystem::path& trace, const Progress& progress = {});

}  // namespace hapticd::trace
