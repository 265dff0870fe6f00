// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"

namespace hapticd::trace {

/// A trace in a folder.
struct TraceEntry {
  std::string name;  ///< without folder and extension; with them if it is a damaged original
  std::uint64_t bytes = 0;
  std::int64_t time_ns = 0;  ///< CLOCK_REALTIME of its last change
  bool open = false;         ///< being written, or left by a crash (".part")
  bool damaged = false;  ///< the original of a trace that was recovered to a new file ("NAME.mcap.damaged")
  bool depth = false;    ///< has raw depth in it
  bool kept = false;     ///< marked to be kept, by an empty file NAME.keep
  std::string note;      ///< a line of text about it, from NAME.note; empty: there is none
  /// CLOCK_REALTIME of its beginning, in whole seconds, from its name; if the name has no time, that of its
  /// last change.
  std::int64_t begin_ns = 0;
  std::optional<bool> clock_is_set = {};  ///< whether that clock told the time; nothing: not known
  std::uint64_t number = 0;               ///< see TraceOptions::number; 0: of another program
};

/// Labels of traces written by the flight recorder: on request, and for the two kinds of faults.
inline constexpr std::string_view kDumpLabel = "dump";
inline constexpr std::string_view kFaultLabel = "fault";
inline constexpr std::string_view kOverrunBurstLabel = "overrun-burst";

/// Returns true for valid names of traces: 1 to 100 letters, digits, '-', '_', '.', not beginning with '.';
/// for a damaged original the name of its trace and the ending of its file.
bool isTraceName(std::string_view name);

/// Returns true for the name of a trace written by the flight recorder: a time and kDumpLabel, kFaultLabel or
/// kOverrunBurstLabel.
bool isDumpName(std::string_view name);

/// Returns a new name from the time and a label, "2026-03-04T05-06-07Z-LABEL"; the label may be empty. If
/// that name exists in the folder, a number is appended.
std::string newTraceName(const std::filesystem::path& folder, std::int64_t realtime_ns,
                         std::string_view label);

/// Returns the traces of the folder, oldest first, by their numbers: the clock may have been wrong. Those
/// without a number come first, by their times. None if there is no such folder. Errors: the folder cannot be
/// read.
base::Result<std::vector<TraceEntry>> listTraces(const std::filesystem::path& folder);

/// Returns the names of unfinished traces; none if the folder cannot be read. Does not access other files, so
/// it is fast in large folders as well.
std::vector<std::string> openTraces(const std::filesystem::path& folder);

/// The longest note of a trace, in bytes: a list of many traces has room for their notes.
inline constexpr std::size_t kMaxNoteLength = 200;

/// The note beside a trace file, finished or not; empty: there is none.
std::string noteOf(const std::filesystem::path& trace_file);

/// Deletes a finished trace and its note.
/// Errors: no such trace, it is being written, it is marked to be kept, no permission.
base::Result<void> deleteTrace(const std::filesystem::path& folder, std::string_view name);

/// Marks a trace, finished or not, to be kept, or removes the mark. The mark survives a crash.
/// Errors: no such trace, no permission, no space.
base::Result<void> keepTrace(const std::filesystem::path& folder, std::string_view name, bool keep);

/// Notes a line of text about a trace, finished or not, in NAME.note; it replaces an earlier note, and an
/// empty text removes it. The note survives a crash. Errors: no such trace, a text that is too long or no
/// printable UTF-8, no permission, no space.
base::Result<void> noteTrace(const std::filesystem::path& folder, std::string_view name,
                             const std::string& text);

/// Which traces a limit on a folder's size may delete.
struct RetentionPlan {
  std::uint64_t bytes = 0;            ///< of all traces
  std::uint64_t protected_bytes = 0;  ///< of those that are never deleted
  std::size_t kept = 0;               ///< number of traces marked to be kept
  std::size_t dumps = 0;              ///< number of unmarked traces written by the flight recorder
  std::vector<TraceEntry> deletable;  ///< all others, oldest first
};

/// Plans which traces may be deleted. Protected are unfinished traces, those marked to be kept, those written
/// by the flight recorder, the newest finished one of the others, and `just_finished`, which is not the
/// newest one if the clock was set back. The damaged original of a recovered trace is like an ordinary trace
/// of the same age. `traces`: oldest first, as returned by listTraces().
RetentionPlan planRetention(std::span<const TraceEntry> traces, std::string_view just_finished);

}  // namespace hapticd::trace
