// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
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
  bool kept = false;         ///< somebody has marked it to be kept, by an empty file NAME.keep
  std::string note;          ///< what somebody has noted about it, the text in NAME.note; empty: nothing
  /// CLOCK_REALTIME of its begin, in whole seconds, as its name says; of a name without a time that of its
  /// last change.
  std::int64_t begin_ns = 0;
};

/// Labels of what the flight recorder writes out: on request, and on the two kinds of faults.
inline constexpr std::string_view kDumpLabel = "dump";
inline constexpr std::string_view kFaultLabel = "fault";
inline constexpr std::string_view kOverrunBurstLabel = "overrun-burst";

/// True for names of traces: 1 to 100 letters, digits, '-', '_', '.', not beginning with '.'.
bool isTraceName(std::string_view name);

/// True for the name of a trace that the flight recorder has written: a time and one of the labels above.
bool isDumpName(std::string_view name);

/// A name from the time and a label, "2026-03-04T05-06-07Z-LABEL"; the label may be empty. With a number
/// behind it where the folder has that already.
std::string newTraceName(const std::filesystem::path& folder, std::int64_t realtime_ns,
                         std::string_view label);

/// Traces of the folder, sorted by their begin, the oldest first. None where there is no such folder.
/// Errors: the folder cannot be read.
config::Result<std::vector<TraceEntry>> listTraces(const std::filesystem::path& folder);

/// Names of the traces that are not finished; none where the folder cannot be read. Looks at no other file,
/// so it is quick in large folders too.
std::vector<std::string> openTraces(const std::filesystem::path& folder);

/// The longest note of a trace, in bytes: a list of many traces has room for their notes.
inline constexpr std::size_t kLongestNote = 200;

/// The note beside a trace file, finished or not; empty: there is none.
std::string noteOf(const std::filesystem::path& trace_file);

/// Deletes a finished trace, its depth recording and its note.
/// Errors: no such trace, it is being written, it is marked to be kept, no permission.
config::Result<void> deleteTrace(const std::filesystem::path& folder, std::string_view name);

/// Marks a trace, finished or not, to be kept, or takes the mark away. The mark survives a crash.
/// Errors: no such trace, no permission, no space.
config::Result<void> keepTrace(const std::filesystem::path& folder, std::string_view name, bool keep);

/// Notes a line of text about a trace, finished or not, in NAME.note; it replaces an earlier note, and an
/// empty text removes it. The note survives a crash. Errors: no such trace, a text that is too long or no
/// printable UTF-8, no permission, no space.
config::Result<void> noteTrace(const std::filesystem::path& folder, std::string_view name,
                               const std::string& text);

}  // namespace hapticd::drivers
