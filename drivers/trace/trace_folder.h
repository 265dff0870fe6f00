#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "config/error.h"

namespace hapticd::drivers {

/// A trace of a folder.
struct TraceEntry {
  std::string name;          ///< without folder and ending
  std::uint64_t bytes = 0;   ///< with a depth recording beside it
  std::int64_t time_ns = 0;  ///< CLOCK_REALTIME of its last change
  bool open = false;         ///< being written, or left by a crash (".part")
  bool depth = false;        ///< raw depth is in it, or in NAME.depth beside it, as of older versions
};

/// True for names of traces: 1 to 100 letters, digits, '-', '_', '.', not beginning with '.'.
bool isTraceName(std::string_view name);

/// A name from the time and a label, "2026-03-04T05-06-07Z-LABEL"; the label may be empty. With a number
/// behind it where the folder has that already.
std::string newTraceName(const std::filesystem::path& folder, std::int64_t realtime_ns,
                         std::string_view label);

/// Traces of the folder, the oldest first. None where there is no such folder.
/// Errors: the folder cannot be read.
config::Result<std::vector<TraceEntry>> listTraces(const std::filesystem::path& folder);

/// Deletes a finished trace and its depth recording.
/// Errors: no such trace, it is being written, no permission.
config::Result<void> deleteTrace(const std::filesystem::path& folder, std::string_view name);

/// Deletes the oldest finished traces until the folder holds no more than `most_bytes`. Returns their names.
/// Errors: the folder cannot be read, one cannot be deleted.
config::Result<std::vector<std::string>> limitFolder(const std::filesystem::path& folder,
                                                     std::uint64_t most_bytes);

}  // namespace hapticd::drivers
