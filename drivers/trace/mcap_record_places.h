// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/trace/mcap_format.h"
#include "drivers/trace/trace_file.h"

/// Where records are in a file that may be damaged.
namespace hapticd::drivers::mcap {

/// Returns whether this version of the format has such records.
bool isKnown(Opcode opcode);

/// A record that is in the file as a whole, if its head is right.
struct RecordPlace {
  Opcode opcode{};
  std::uint64_t begin = 0;  ///< in the file
  std::uint64_t end = 0;

  std::uint64_t length() const { return end - begin - kRecordHeadBytes; }  ///< of its content
};

/// Reads parts of a file, and remembers the first error of the system.
/// Thread: one.
class FileBytes {
 public:
  FileBytes(const TraceFile& file, std::uint64_t size) : file_(file), size_(size) {}

  std::string at(std::uint64_t offset, std::uint64_t length);
  /// Returns nothing if no whole record can begin there.
  std::optional<RecordPlace> head(std::uint64_t offset);
  std::string content(const RecordPlace& place) { return at(place.begin + kRecordHeadBytes, place.length()); }
  bool isClosingMagic(std::uint64_t offset);
  /// Returns whether a record may begin there, which may be cut off, or the file ends there.
  bool mayContinueAt(std::uint64_t offset);
  std::uint32_t crc(std::uint64_t from, std::uint64_t to);

  std::uint64_t size() const { return size_; }
  const std::optional<config::Error>& failure() const { return failure_; }

 private:
  const TraceFile& file_;
  std::uint64_t size_;
  std::optional<config::Error> failure_;
};

/// The part of a ChunkIndex record that identifies its chunk.
struct IndexedChunk {
  std::uint64_t start_ns = 0, end_ns = 0, offset = 0, bytes = 0;

  static IndexedChunk of(std::string_view content);
};

/// The chunks that the summary names, if its checksum matches.
/// Thread: one.
class ChunkPlaces {
 public:
  explicit ChunkPlaces(FileBytes& bytes);

  /// Returns whether the summary names this record, or there is no summary.
  bool mayBe(const RecordPlace& chunk) const;
  /// Returns where the next such chunk after `offset` begins, or else where the data end. Only chunks whose
  /// record has the length that the summary states count.
  std::optional<std::uint64_t> next(std::uint64_t offset);

 private:
  FileBytes& bytes_;
  std::map<std::uint64_t, std::uint64_t> places_;  ///< length of the record by its offset
  std::uint64_t data_end_ = 0;                     ///< 0: there is no summary
};

}  // namespace hapticd::drivers::mcap
