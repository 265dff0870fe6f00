// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "tools/haptic-replay/trace_replay.h"
#include "tools/lib/parts/parts.h"

/// All traces of a folder computed again, one after the other, or divided over computers.
namespace hapticd::tools {

struct TraceFile {
  std::string name;  ///< without folder
  std::uint64_t bytes = 0;
};

/// What became of one trace.
struct TraceOutcome {
  std::string name;            ///< of the file, without folder
  std::string error;           ///< why it could not be replayed; empty: it was
  TraceComparison comparison;  ///< of all ticks up to the error
};
auto fieldsOf(Is<TraceOutcome> auto& outcome) {
  auto& [name, error, comparison] = outcome;
  return std::tie(name, error, comparison);
}

/// The finished traces (*.mcap) of the folder in the order of their names.
/// Errors: the folder cannot be read, or holds none.
base::Result<std::vector<TraceFile>> tracesIn(const std::filesystem::path& folder);

/// Replays a trace and, unless `out` is empty, writes the forces to `out`/NAME.csv.
TraceOutcome replayOne(const std::filesystem::path& trace, const std::filesystem::path& out);

/// Every trace, and all together, for people and for programs.
std::string outcomesText(const std::vector<TraceOutcome>& outcomes);
std::string outcomesJson(const std::vector<TraceOutcome>& outcomes);

/// The run of which the traces are the cases.
DividedRun runOf(const std::vector<TraceFile>& traces);

}  // namespace hapticd::tools
