// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <expected>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "config/error.h"
#include "drivers/trace/mcap_format.h"
#include "drivers/trace/trace_file.h"

namespace hapticd::drivers::mcap {

/// Why a file cannot be read on.
struct Fault {
  enum class Kind {
    foreign,     ///< no MCAP file, or none of hapticd
    cut,         ///< it ends too early
    damaged,     ///< something in it is wrong
    unreadable,  ///< the system does not let us
  };
  Kind kind = Kind::damaged;
  config::Error error;
};

/// A record outside of chunks.
struct Record {
  Opcode opcode = Opcode::header;
  std::uint64_t offset = 0;  ///< in the file
  std::string_view content;  ///< until the next record is read
  std::uint32_t crc = 0;     ///< of all before it, from where the checksum began

  std::uint64_t bytes() const { return kRecordHeadBytes + content.size(); }
};

/// What a record begins with.
struct RecordHead {
  Opcode opcode = Opcode::header;
  std::uint64_t offset = 0;  ///< of the record in the file
  std::uint64_t length = 0;  ///< of its content, all of which is in the file

  std::uint64_t end() const { return offset + kRecordHeadBytes + length; }
};

/// Goes through the records of a file one by one, with a bound on memory.
/// Thread: one.  RT: not safe.
class Scanner {
 public:
  static std::expected<Scanner, Fault> open(const std::filesystem::path& file);

  /// Errors: the file ends, a record that is too long.
  std::expected<Record, Fault> next();
  /// Of the next record, which stays the next one. The same errors.
  std::expected<RecordHead, Fault> head() const;
  /// Goes on at that place, without a checksum of what is before it.
  void jump(std::uint64_t offset) { offset_ = offset; }
  /// True if the file's last bytes are next, as they should be.
  std::expected<bool, Fault> atClosingMagic();
  /// These bytes, fewer at the end of the file.
  std::expected<void, Fault> read(std::uint64_t offset, std::size_t length, std::string& to) const;
  /// The next bytes, fewer at the end of the file. They stay the next ones.
  std::expected<std::string, Fault> peek(std::size_t length) const;
  /// Goes on behind these bytes, which are, or ought to be, the next ones.
  void skip(std::string_view bytes);
  /// Back to the first record, with the checksum of what is before it.
  void restart();
  /// Begins the checksum anew.
  void restartCrc() { crc_ = 0; }

  std::uint64_t offset() const { return offset_; }  ///< of the next record
  std::uint32_t crc() const { return crc_; }        ///< of all before it, from where it began
  std::uint64_t size() const { return size_; }      ///< of the file

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

}  // namespace hapticd::drivers::mcap
