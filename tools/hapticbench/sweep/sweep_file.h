// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/error.h"
#include "tools/hapticbench/sweep/sweep_run.h"

namespace hapticd::tools {

/// The results of one run of a sweep; the shard of a whole sweep is 1/1.
struct SweepPart {
  std::string name{};  ///< of the file, for messages
  SweepSettings settings{};
  Shard shard{};
  std::vector<SweepResult> results{};
};

/// Returns the part as JSON, with all digits.
std::string sweepJson(const SweepPart& part);

/// Reads what sweepJson() wrote. `name`: of the file, for errors.
/// Errors: not JSON, not of a sweep, of another version of the format.
config::Result<SweepPart> parseSweep(const std::string& name, const std::string& text);

/// Joins the whole sweep from its parts, in the order of the grid.
/// Errors: parts of different sweeps or of differently many, the same part twice, a part that is not there, a
/// part without all its points or with others'.
config::Result<SweepPart> mergeSweep(const std::vector<SweepPart>& parts);

/// The table for people, in the order of the laws.
std::string sweepText(const SweepPart& part);

}  // namespace hapticd::tools
