// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "daemon/trace/export/selected_trace.h"
#include "daemon/trace/reader/trace_reader.h"
#include "rt/base/vec3.h"

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

}  // namespace hapticd::trace
