// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "daemon/trace/mcap/mcap_format.h"
#include "daemon/trace/mcap/trace_file.h"

namespace hapticd::trace::mcap {

/// A fault of a file.
struct Damage {
  std::uint64_t offset = 0;  ///< in the file
  std::uint64_t bytes = 0;   ///< 0: something is missing here
  std::string what = {};
  /// Messages, metadata or attachments may be lost; otherwise it can be rebuilt from intact records.
  bool loses = true;
  // CLOCK_REALTIME of the last message before it and the first one after it according to the intact chunks;
  // 0: none
  std::uint64_t after_ns = 0;
  std::uint64_t before_ns = 0;
};

/// A chunk whose records are intact.
struct IntactChunk {
  std::uint64_t offset = 0;  ///< offset of the record in the file
  std::uint64_t bytes = 0;
  std::uint64_t start_ns = 0;  ///< time of its earliest message
  std::uint64_t end_ns = 0;    ///< time of its latest message
};

/// An intact record other than a chunk.
struct IntactRecord {
  std::uint64_t offset = 0;
  std::string content;
};

/// The intact parts of a file.
struct Salvage {
  std::uint64_t file_bytes = 0;
  // by id; those of the summary where it is intact
  std::map<std::uint16_t, IntactRecord> schemas;
  std::map<std::uint16_t, IntactRecord> channels;
  std::vector<IntactRecord> metadata;
  std::vector<IntactRecord> attachments;
  std::vector<IntactChunk> chunks;  ///< in file order
  Summary chunk_summary;            ///< of these chunks alone, where they are
  std::string missing_indexes;      ///< of the last chunk that has not all of them
  std::set<std::uint16_t> used_channels;
  std::vector<Damage> damages;  ///< in file order
  /// Where all that is intact ends, if nothing before it is damaged: only the end of the file is missing.
  std::optional<std::uint64_t> intact_to;
  /// Number of messages according to the summary, if that is intact.
  std::optional<std::uint64_t> messages_meant;
  std::uint64_t messages_whole = 0;
};

/// Called occasionally with the fraction of the work done, 0..1; returns false to stop it. May be empty.
using GoesOn = std::function<bool(double)>;

/// The error of work that was stopped by GoesOn.
base::Error interrupted(const std::filesystem::path& file);

/// Finds the intact parts of a file as hapticd writes it, record by record: one with a fault is left out.
/// Where the length of a record is damaged, so that no other one follows it, the search goes on at the next
/// chunk that the summary names, and ends if there is none, as in a file that was never closed. Errors: the
/// file cannot be read, stopped. Time: linear in its size. Memory: one record and one uncompressed chunk,
/// limited as mcap_format.h says, and the records outside of chunks.
base::Result<Salvage> salvage(const TraceFile& file, std::uint64_t size, const GoesOn& goes_on);

/// Computes the checksum of a part of a file.
base::Result<std::uint32_t> crcOf(const TraceFile& file, std::uint64_t from, std::uint64_t to);

}  // namespace hapticd::trace::mcap

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
