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
#include "daemon/trace/mcap/mcap_definitions.h"
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
