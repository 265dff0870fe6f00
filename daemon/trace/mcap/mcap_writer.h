// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/base/error.h"
#include "daemon/trace/mcap/mcap_format.h"
#include "daemon/trace/mcap/trace_file.h"

namespace hapticd::trace::mcap {

/// When what is written must be on the disk.
enum class Durable { each_chunk, whole_file };

/// Writes an MCAP file: header, schemas, channels, metadata and attachments at the beginning, then messages
/// in chunks, each of which is on disk before the next one begins, unless only the whole file counts. The
/// messages of the file are in the order of their log times; they are held until their chunk is written
/// (memory: pendingBytes() plus a copy). Thread: one.  RT: not safe.
class Writer {
 public:
  /// `part`: the new file; finish() renames it to `file`. `profile`: of MCAP, which prescribes what channels
  /// say of themselves; empty: none.
  Writer(TraceFile part, std::filesystem::path file, bool compress, std::string_view profile = "",
         Durable durable = Durable::each_chunk);

  // Called before begin(). Ids are 1, 2, ...
  std::uint16_t addChannel(std::string_view topic, std::string_view schema_name, std::string_view schema,
                           TextPairs metadata = {});
  void addMetadata(std::string_view name, TextPairs pairs);
  void addAttachment(const AttachmentRecord& attachment);
  /// Adds a schema, a channel, metadata or an attachment of another file. `content`: of its record.
  void add(Opcode opcode, std::string_view content);
  /// Writes the beginning of the file.
  base::Result<void> begin();
  /// Writes an attachment between the chunks. Errors: as flush().
  base::Result<void> attach(const AttachmentRecord& attachment);
  /// Writes metadata between the chunks. Errors: as flush().
  base::Result<void> describe(std::string_view name, TextPairs pairs);

  /// Writes a chunk of another file with its records unchanged and indexes of their `content`.
  base::Result<void> addChunk(const ChunkRecord& chunk, const ChunkContent& content);
  /// Adds a message to a future chunk. `time_ns` is its publish time, and its log time too unless a later
  /// one is in a chunk already: its log time is then that of the last message written.
  void addMessage(std::uint16_t channel, std::uint32_t sequence, std::uint64_t time_ns,
                  std::string_view message);
  /// Returns the error after which nothing more is written.
  const std::optional<base::Error>& failure() const { return failure_; }

  // Size and number of messages that are not in a chunk yet.
  std::size_t pendingBytes() const { return pending_.size(); }
  std::uint64_t pendingMessages(std::uint16_t channel) const;
  /// Returns the log time of the earliest pending message; there must be one.
  std::uint64_t earliestPending_ns() const { return earliest_ns_; }

  /// Writes a chunk with all pending messages. After an error the file ends with its last complete chunk, and
  /// only finish() writes again.
  base::Result<void> flush();
  /// Writes a chunk with the messages up to `time_ns` only, if there are any, so that late messages still
  /// fit into the next chunk.
  base::Result<void> flushUpTo(std::uint64_t time_ns);
  /// Writes the open chunk and the end of the file, and renames it. Does nothing after it has succeeded; may
  /// be retried after a failure.
  /// Errors: also that of the open chunk, although the file is finished.
  base::Result<void> finish();
  /// Writes the open chunk and the end of the file without renaming it. Errors: as flush().
  base::Result<void> end();

  const std::filesystem::path& file() const { return file_; }
  std::uint64_t bytes() const { return end_; }

 private:
  /// Pieces of the file that follow each other.
  using Parts = std::initializer_list<std::string_view>;
  base::Result<void> append(Parts parts);
  base::Result<void> appendBetweenChunks(Parts record);
  struct Pending {
    std::uint64_t time_ns = 0;  ///< log time
    std::uint16_t channel = 0;
    std::size_t offset = 0;  ///< of the record in `pending_`
    std::size_t bytes = 0;
  };
  std::string takeUpTo(std::uint64_t time_ns);
  base::Result<void> write(const std::string& records);
  base::Result<void> writeEnding();

  TraceFile part_;
  std::filesystem::path file_;
  Durable durable_;
  std::optional<Compressor> compressor_;
  Summary summary_;
  std::string head_;
  std::string pending_;  ///< records not in a chunk yet, in the order of arrival
  std::vector<Pending> places_;
  std::uint64_t earliest_ns_ = 0;    ///< log time of these records
  std::uint64_t chunks_end_ns_ = 0;  ///< log time of the last message in a chunk
  std::string compressed_;
  std::uint16_t channels_ = 0;
  std::uint64_t end_ = 0;  ///< length of the complete part
  std::uint32_t crc_ = 0;  ///< checksum of the complete part
  bool finished_ = false;
  std::optional<base::Error> failure_;
};

}  // namespace hapticd::trace::mcap
