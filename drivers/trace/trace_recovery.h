// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "config/error.h"
#include "drivers/trace/mcap_salvage.h"

namespace hapticd::drivers {

/// What a recovery has made of a trace. No chunk that is whole is ever lost by it.
struct RecoveredTrace {
  enum class Outcome {
    intact,     ///< nothing was wrong with it; it was left as it is (without ".part")
    ended,      ///< only its ending was missing, and what was being written: finished in place
    rewritten,  ///< something in it is damaged: what is whole was written into a new file
    empty,      ///< ended, but it broke off before its first chunk was whole: it holds no message
    hopeless,   ///< nothing whole is in it
  };
  Outcome outcome = Outcome::intact;
  std::filesystem::path file = {};  ///< the readable one; none if it is hopeless
  std::filesystem::path original =
      {};                        ///< where the damaged one is kept; empty: there is none, or it was finished
  std::uint64_t chunks = 0;      ///< in the readable one
  std::uint64_t bytes_lost = 0;  ///< of the original, that could not be kept
  /// Messages that the original counts and the readable file does not hold; nothing: it counts none.
  std::optional<std::uint64_t> messages_lost = {};
  /// Missing between the first tick and the last one, whoever lost them.
  std::uint64_t ticks_missing = 0;
  std::vector<mcap::Damage> damages = {};  ///< all that was not as it should be, in its order in the original
};

/// Gets the share of the work that is done, 0..1, now and then; may be empty.
using RecoveryProgress = std::function<void(double)>;

/// The name that recoverTrace() gives by itself: NAME-recovered.mcap beside NAME.mcap or NAME.mcap.part.
std::filesystem::path recoveredName(const std::filesystem::path& file);

/// Writes all that is whole in a trace into `out`: what is damaged is skipped, wherever it is. The trace
/// itself is only read. One with which nothing is wrong is not written again. Errors: no trace of hapticd,
/// one that is being written, nothing whole in it, `out` exists, no permission, no space. Then there is no
/// new file.
config::Result<RecoveredTrace> recoverTrace(const std::filesystem::path& file,
                                            const std::filesystem::path& out,
                                            const RecoveryProgress& progress = {});

/// Finishes a ".part" that a crash has left and gives it its name. In place where only what was being written
/// is cut off; where something else is damaged, all that is whole goes into a new file of that name, and the
/// damaged one is kept as NAME.mcap.damaged, as is one in which nothing is whole. Errors: as of
/// recoverTrace(), but for nothing whole; the ".part" is left as it was, to be tried again.
config::Result<RecoveredTrace> finishTrace(const std::filesystem::path& part,
                                           const RecoveryProgress& progress = {});

}  // namespace hapticd::drivers
