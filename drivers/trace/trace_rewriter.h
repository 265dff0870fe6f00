// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

#include "config/base/error.h"
#include "drivers/trace/mcap/mcap_salvage.h"
#include "drivers/trace/mcap/trace_file.h"

namespace hapticd::drivers {

/// Writes the intact parts of a file to a new one in time order: definitions, metadata and attachments, then
/// chunks with their records unchanged, with new indexes and a new summary. `out` must not exist; while it is
/// being written its name ends in ".rewriting", which hapticd does not treat as an unfinished trace.
/// Errors: system errors, stopped; there is then no new file.
base::Result<void> rewriteTrace(const TraceFile& from, const mcap::Salvage& whole,
                                const std::filesystem::path& out, const mcap::GoesOn& goes_on);

/// Writes the ending of a file that was never closed after its intact part, which ends at `intact_to`. It may
/// be interrupted at any time and repeated.
base::Result<void> endTrace(TraceFile& file, const mcap::Salvage& whole, std::uint64_t intact_to,
                            const mcap::GoesOn& goes_on);

}  // namespace hapticd::drivers
