// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "config/error.h"
#include "drivers/trace/mcap_salvage.h"
#include "drivers/trace/trace_file.h"

namespace hapticd::drivers {

/// Writes what is whole in a file into a new one, in the order of time: definitions, metadata and
/// attachments, then chunks with their records as they are, with new indexes and a new summary. `out`: it
/// does not exist; while it is written its name ends in ".rewriting", which no start of hapticd takes for a
/// trace that it has to finish. Errors: what the system says; then there is no new file.
config::Result<void> rewriteTrace(const TraceFile& from, const mcap::Salvage& whole,
                                  const std::filesystem::path& out,
                                  const std::function<void(double)>& progress);

/// Writes the ending of a file that was never closed, behind what is whole of it, which ends at `whole_to`.
/// It may be cut short at any time and done again.
config::Result<void> endTrace(TraceFile& file, const mcap::Salvage& whole, std::uint64_t whole_to);

}  // namespace hapticd::drivers
