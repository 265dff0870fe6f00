// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/error.h"
#include "drivers/trace/compression.h"
#include "drivers/trace/mcap_format.h"
#include "drivers/trace/mcap_summary.h"
#include "drivers/trace/trace_file.h"

namespace hapticd::drivers::mcap {

/// Writes an MCAP file: header, schemas, channels, metadata and attachments at its begin, then messages in
/// chunks, each of which is on the disk before the next one begins. The messages of a chunk are in the order
/// of their times; messages are held until their chunk is written (memory: pendingBytes() and a copy of
/// them). Thread: one.  RT: not safe.
class Writer {
 public:
  using Pairs = std::span<const std::pair<std::string, std::string>>;

  /// Begins `part`, which does not exist; finish() renames it to `file`.
  Writer(TraceFile part, std::filesystem::path file, bool compress);

  // Before begin(). Ids are 1, 2, ...
  std::uint16_t addChannel(std::string_view topic, std::string_view schema_name, std::string_view schema);
  void addMetadata(std::string_view name, Pairs pairs);
  void addAttachment(const AttachmentRecord& attachment);
  /// Writes all that.
  config::Result<void> begin();

  /// For a chunk to come.
  void addMessage(std::uint16_t channel, std::uint32_t sequence, std::uint64_t time_ns,
                  std::string_view message);
  /// Why nothing more is written.
  const std::optional<config::Error>& failure() const { return failure_; }

  // of messages that are in no chunk yet
  std::size_t pendingBytes() const { return pending_.size(); }
  std::uint64_t pendingMessages(std::uint16_t channel) const;
  /// Of the earliest one, and of the latest one. There are some.
  std::pair<std::uint64_t, std::uint64_t> pendingTimes_ns() const { return {earliest_ns_, latest_ns_}; }

  /// Writes a chunk of all pending messages. After an error the file ends with its last whole chunk, and
  /// nothing more is written but by finish().
  config::Result<void> flush();
  /// The same with those before that time only, if there are any, so that messages which come late still get
  /// into the chunk after it.
  config::Result<void> flushBefore(std::uint64_t time_ns);
  /// Writes the open chunk and the file's end, and renames it. Without effect if it succeeded before; may be
  /// tried again if it failed.
  /// Errors: also that of the open chunk, with a file that is finished nevertheless.
  config::Result<void> finish();

  const std::filesystem::path& file() const { return file_; }
  std::uint64_t bytes() const { return end_; }

 private:
  config::Result<void> append(std::string_view bytes);
  struct Pending {
    std::uint64_t time_ns = 0;
    std::uint16_t channel = 0;
    std::size_t offset = 0;  ///< of the record in `pending_`
    std::size_t bytes = 0;
  };
  std::string takeBefore(std::uint64_t time_ns);
  config::Result<void> write(const std::string& records);
  config::Result<void> writeEnding();

  TraceFile part_;
  std::filesystem::path file_;
  std::optional<Compressor> compressor_;
  Summary summary_;
  std::string head_;
  std::string pending_;  ///< records that are in no chunk yet, in the order in which they came
  std::vector<Pending> places_;
  // of those
  std::uint64_t earliest_ns_ = 0;
  std::uint64_t latest_ns_ = 0;
  std::string compressed_;
  std::uint16_t channels_ = 0;
  std::uint64_t end_ = 0;  ///< of what is whole
  std::uint32_t crc_ = 0;  ///< of it
  bool finished_ = false;
  std::optional<config::Error> failure_;
};

}  // namespace hapticd::drivers::mcap
