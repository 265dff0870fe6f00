// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "drivers/trace/mcap_format.h"
#include "drivers/trace/trace_file.h"

namespace hapticd::drivers::mcap {

/// Something in a file that is not as it should be.
struct Damage {
  std::uint64_t offset = 0;  ///< in the file
  std::uint64_t bytes = 0;   ///< 0: nothing is there that should be
  std::string what = {};
  /// Messages, metadata or attachments may be lost by it; else it follows from what is whole.
  bool loses = true;
  // CLOCK_REALTIME of the last message before it and of the first one behind it, as the whole chunks say; 0:
  // none
  std::uint64_t after_ns = 0;
  std::uint64_t before_ns = 0;
};

/// A chunk whose records are whole.
struct WholeChunk {
  std::uint64_t offset = 0;  ///< of the record in the file
  std::uint64_t bytes = 0;
  std::uint64_t start_ns = 0;  ///< of its messages
  std::uint64_t end_ns = 0;
  bool indexed = false;  ///< its indexes follow as this program writes them
  std::uint64_t index_bytes = 0;

  std::uint64_t end() const { return offset + bytes + (indexed ? index_bytes : 0); }
};

/// A whole record that is no chunk.
struct WholeRecord {
  std::uint64_t offset = 0;
  std::string content;
};

/// What of a file is whole, wherever in it that is.
struct Salvage {
  // those of the summary too; each once
  std::vector<WholeRecord> schemas;
  std::vector<WholeRecord> channels;
  std::vector<WholeRecord> metadata;
  std::vector<WholeRecord> attachments;
  std::vector<WholeChunk> chunks;     ///< in their order in the file
  std::vector<WholeRecord> messages;  ///< outside of chunks
  std::set<std::uint16_t> used_channels;
  std::vector<Damage> damages;  ///< in their order in the file
  bool ended = false;           ///< footer and magic are there
  /// That the summary counts, if that is whole.
  std::optional<std::uint64_t> messages_meant;
  std::uint64_t messages_whole = 0;
};

/// Looks for everything that is whole in a file: where a record is not, it goes on at the next one that is,
/// by its checksum or by what follows it. `progress`: share done, 0..1; may be empty. Errors: the system does
/// not let us read. Memory: a record and an uncompressed chunk, of bounded size whatever the file says, and
/// what is outside of chunks.
config::Result<Salvage> salvage(const TraceFile& file, std::uint64_t size,
                                const std::function<void(double)>& progress);

}  // namespace hapticd::drivers::mcap
