#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "config/error.h"

namespace hapticd::drivers {

struct RecoveredTrace {
  std::filesystem::path file;   ///< the readable one; empty: nothing whole was in it, and it was removed
  std::uint64_t chunks = 0;     ///< kept
  std::uint64_t bytes_cut = 0;  ///< of the chunk that was being written, or damaged
};

/// Makes a readable trace of one that was never closed, or is cut off or damaged at its end: all up to the
/// last whole chunk is kept byte by byte, summary and footer are written anew, and a name ending in ".part"
/// loses that.
/// In place: a file that is complete is left alone. `progress`: share done, 0..1; may be empty.
/// Errors: no MCAP file (left alone), no permission, no space (left alone, to be tried again).
config::Result<RecoveredTrace> recoverTrace(const std::filesystem::path& file,
                                            const std::function<void(double)>& progress = {});

}  // namespace hapticd::drivers
