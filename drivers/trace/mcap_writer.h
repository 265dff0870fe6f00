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
#include "drivers/trace/trace_file.h"

namespace hapticd::drivers::mcap {

/// Writes an MCAP file: header, schemas, channels, metadata and attachments at its begin, then messages in
/// chunks, each of which is on the disk before the next one begins.
/// Thread: one.  RT: not safe.
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

  /// Into the open chunk.
  void addMessage(std::uint16_t channel, std::uint32_t sequence, std::uint64_t time_ns,
                  std::string_view message);
  /// Why nothing more is written.
  const std::optional<config::Error>& failure() const { return failure_; }
  std::size_t pendingBytes() const { return chunk_.size(); }

  /// Writes the open chunk. After an error the file ends with its last whole chunk, and nothing more is
  /// written but by finish().
  config::Result<void> flush();
  /// Writes the open chunk and the file's end, and renames it. Without effect if it succeeded before; may be
  /// tried again if it failed.
  /// Errors: also that of the open chunk, with a file that is finished nevertheless.
  config::Result<void> finish();

  const std::filesystem::path& file() const { return file_; }
  std::uint64_t bytes() const { return end_; }

 private:
  config::Result<void> append(std::string_view bytes);
  config::Result<void> writeChunk();
  config::Result<void> writeEnding();

  TraceFile part_;
  std::filesystem::path file_;
  std::optional<Compressor> compressor_;
  Summary summary_;
  std::string head_;
  std::string chunk_;  ///< records of the open chunk
  std::string compressed_;
  std::uint16_t channels_ = 0;
  std::uint64_t end_ = 0;  ///< of what is whole
  std::uint32_t crc_ = 0;  ///< of it
  bool finished_ = false;
  std::optional<config::Error> failure_;
};

}  // namespace hapticd::drivers::mcap
