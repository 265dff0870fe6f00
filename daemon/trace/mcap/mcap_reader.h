// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <expected>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/base/error.h"
#include "daemon/trace/mcap/mcap_format.h"
#include "daemon/trace/mcap/trace_file.h"

namespace hapticd::trace::mcap {

/// Why reading a file cannot continue.
struct Fault {
  enum class Kind {
    foreign,     ///< not an MCAP file, or not one of hapticd
    cut,         ///< it ends prematurely
    damaged,     ///< its content is invalid
    unreadable,  ///< system error
  };
  Kind kind = Kind::damaged;
  base::Error error;
};

/// The error where std::bad_alloc ends the reading of a file.
base::Error outOfMemory(const std::filesystem::path& file);

/// A record outside of chunks.
struct Record {
  Opcode opcode = Opcode::header;
  std::uint64_t offset = 0;  ///< in the file
  std::string_view content;  ///< valid until the next record is read
  std::uint32_t crc = 0;     ///< checksum of everything before it, from where the checksum started

  std::uint64_t bytes() const { return kRecordHeadBytes + content.size(); }
};

/// Opcode and length of a record.
struct RecordHead {
  Opcode opcode = Opcode::header;
  std::uint64_t offset = 0;  ///< of the record in the file
  std::uint64_t length = 0;  ///< of its content, which is completely in the file

  std::uint64_t end() const { return offset + kRecordHeadBytes + length; }
};

/// Iterates over the records of a file with limited memory.
/// Thread: one.  RT: not safe.
class Scanner {
 public:
  /// Opens a file and checks its magic bytes.
  static std::expected<Scanner, Fault> open(const std::filesystem::path& file);

  /// Returns the next record.  Errors: the file ends, the record is too long.
  std::expected<Record, Fault> next();
  /// Returns the head of the next record without advancing.  Errors: see next().
  std::expected<RecordHead, Fault> head() const;
  /// Continues at this offset, without a checksum of what is before it.
  void jump(std::uint64_t offset) { offset_ = offset; }
  /// Returns true if the closing magic of the file is next.
  std::expected<bool, Fault> atClosingMagic();
  /// Reads bytes; fewer at the end of the file.
  std::expected<void, Fault> read(std::uint64_t offset, std::size_t length, std::string& to) const;
  /// Reads the next bytes without advancing; fewer at the end of the file.
  std::expected<std::string, Fault> peek(std::size_t length) const;
  /// Skips these bytes, which are the next ones.
  void skip(std::string_view bytes);
  /// Returns to the first record; the checksum restarts.
  void restart();
  /// Restarts the checksum.
  void restartCrc() { crc_ = 0; }

  std::uint64_t offset() const { return offset_; }  ///< of the next record
  /// Of everything before the next record, from where the checksum started.
  std::uint32_t crc() const { return crc_; }
  std::uint64_t size() const { return size_; }  ///< of the file

  Fault damaged(std::uint64_t offset, std::string_view what) const;
  Fault foreign(std::string_view what, std::string_view remedy) const;

 private:
  Scanner(TraceFile file, std::uint64_t size) : file_(std::move(file)), size_(size) {}

  TraceFile file_;
  std::uint64_t size_;
  std::uint64_t offset_ = 0;
  std::uint32_t crc_ = 0;
  std::string content_;
};

using Pairs = std::vector<std::pair<std::string, std::string>>;

/// A message with the id of its channel.
struct Message {
  std::uint64_t offset = 0;  ///< in the file, of its record or of the chunk that holds it
  std::uint16_t channel = 0;
  std::uint64_t time_ns = 0;          ///< log time
  std::uint64_t publish_time_ns = 0;  ///< not later in what hapticd writes
  std::string_view data;
};

/// Reason of a visitor to reject a valid file.
struct Refusal {
  std::string what;
  std::string remedy;
};

/// Receives the content of a file: first the metadata and attachments and the channels defined outside of
/// chunks, then the messages in the order of the file, each after its channel.
class Visitor {
 public:
  virtual ~Visitor() = default;
  virtual void metadata(std::string_view /*name*/, Pairs /*pairs*/) {}
  virtual void attachment(const AttachmentRecord& /*attachment*/) {}
  /// Called once per channel; several may have the same topic.
  virtual void channel(const Channel& channel) = 0;
  /// Called before the first message; after it, only messages and channels defined in chunks follow.
  virtual void messages() {}
  /// Processes a message. Returns a description of its fault, or "".
  virtual std::string message(const Message& /*message*/) { return ""; }
  /// Called for each chunk at `offset` of a file of `size` bytes, before its messages.
  virtual void chunk(std::uint64_t /*offset*/, std::uint64_t /*size*/) {}
  /// Returns true to stop reading.
  virtual bool enough() const { return false; }
  /// Returns the reason for stopping if the file is unsuitable.
  virtual std::optional<Refusal> refusal() const { return {}; }
};

/// Reads a file from beginning to end, or until enough(), and verifies all checksums present. Any file
/// permitted by the specification is read: with or without chunks, compressed with lz4, zstd or not at all,
/// with or without a summary. Memory: one record, one uncompressed chunk, and the schemas.
std::expected<void, Fault> read(const std::filesystem::path& file, Visitor& visitor);

}  // namespace hapticd::trace::mcap
