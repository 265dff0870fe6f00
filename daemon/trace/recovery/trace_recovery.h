// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "config/base/error.h"
#include "daemon/trace/mcap/mcap_salvage.h"
#include "daemon/trace/mcap/trace_file.h"

namespace hapticd::trace {

/// Result of a recovery. No intact chunk is ever lost.
struct RecoveredTrace {
  enum class Outcome {
    intact,     ///< nothing was wrong; it was not changed (except for ".part")
    ended,      ///< only its ending and the chunk being written were missing; finished in place
    rewritten,  ///< partly damaged: the intact parts were written to a new file
    empty,      ///< finished in place, but without any message, because its first chunk was incomplete
    hopeless,   ///< no part is intact
  };
  Outcome outcome = Outcome::intact;
  std::filesystem::path file = {};  ///< the readable file; none if hopeless
  /// Where the damaged original is kept; empty: there is none, or it was finished in place.
  std::filesystem::path original = {};
  std::uint64_t chunks = 0;      ///< in the readable file
  std::uint64_t bytes_lost = 0;  ///< bytes of the original that could not be kept
  /// Number of messages counted in the original but missing in the readable file; nothing: unknown.
  std::optional<std::uint64_t> messages_lost = {};
  /// Ticks missing between the first and the last one, for whatever reason.
  std::uint64_t ticks_missing = 0;
  std::vector<mcap::Damage> damages = {};  ///< all faults, in the order of the original
};

/// Called occasionally with the fraction of a step of the work done, 0..1; returns false to stop: the trace
/// is then unchanged, and the work can be done again. May be empty.
using RecoveryProgress = mcap::GoesOn;

/// Returns the default name for recoverTrace(): NAME-recovered.mcap next to NAME.mcap or NAME.mcap.part.
std::filesystem::path recoveredName(const std::filesystem::path& file);

/// Writes all intact parts of a trace to `out`, skipping damaged ones. The trace itself is only read; an
/// intact trace is not written again.
/// Errors: not a trace of hapticd, being written, nothing intact in it, `out` exists, no permission, no
/// space. There is then no new file.
base::Result<RecoveredTrace> recoverTrace(const std::filesystem::path& file, const std::filesystem::path& out,
                                          const RecoveryProgress& progress = {});

/// Finishes a ".part" left by a crash and gives it its final name: in place if only what was being written is
/// truncated. If something else is damaged, all intact parts go to a new file of that name, and the damaged
/// one is kept as NAME.mcap.damaged, as is one without any intact part.
/// Errors: see recoverTrace(), except for nothing intact; the ".part" is then unchanged and can be tried
/// again.
base::Result<RecoveredTrace> finishTrace(const std::filesystem::path& part,
                                         const RecoveryProgress& progress = {});

}  // namespace hapticd::trace
