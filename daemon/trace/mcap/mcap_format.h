// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/base/crc32.h"

/// The container format MCAP (mcap.dev/spec, version 0): parts shared by writer, reader and recovery.
namespace hapticd::trace {

/// zstd compression with reusable buffers.
/// Thread: one.  RT: not safe.
class Compressor {
 public:
  Compressor();
  ~Compressor();
  Compressor(const Compressor&) = delete;
  Compressor& operator=(const Compressor&) = delete;

  /// Compresses `bytes` to one zstd frame in `to`. Returns false if that is not shorter or memory is
  /// exhausted.
  bool compress(std::string_view bytes, std::string& to);

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

// Decompresses `bytes` to exactly `length` bytes in `to`. Returns false if they are not frames of that
// compression or contain another number of bytes. Memory grows with the actual output, not with `length`.
bool decompressZstd(std::string_view bytes, std::size_t length, std::string& to);
bool decompressLz4(std::string_view bytes, std::size_t length, std::string& to);

/// Decompresses a zstd frame of unknown content size to `to`. Returns false if it is invalid or its content
/// is longer than `max_bytes`; no memory is allocated for such content.
bool decompressUpTo(std::string_view bytes, std::size_t max_bytes, std::string& to);

}  // namespace hapticd::trace

namespace hapticd::trace::mcap {

static_assert(std::endian::native == std::endian::little, "numbers are copied in the file's own byte order");

/// Appends little-endian numbers, and texts preceded by their lengths, as in MCAP.
class ByteWriter {
 public:
  explicit ByteWriter(std::string& to) : to_(to) {}

  template <std::unsigned_integral Number>
  void number(Number value) {
    to_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void raw(std::string_view bytes) { to_.append(bytes); }
  void text(std::string_view text) {
    number(static_cast<std::uint32_t>(text.size()));
    raw(text);
  }
  /// Appends each value: an unsigned number or a text.
  void put(const auto&... values) {
    const auto one = [this]<typename Value>(const Value& value) {
      if constexpr (std::unsigned_integral<Value>) {
        number(value);
      } else {
        text(value);
      }
    };
    (one(values), ...);
  }
  /// Appends the output of `fill`, preceded by its length in bytes.
  template <std::unsigned_integral Length, typename Fill>
  void sized(Fill fill) {
    const std::size_t at = to_.size();
    number(Length{0});
    fill();
    const auto length = static_cast<Length>(to_.size() - at - sizeof(Length));
    std::memcpy(to_.data() + at, &length, sizeof length);
  }

 private:
  std::string& to_;
};

/// Reads little-endian numbers, and texts preceded by their lengths. Reading beyond the end makes good()
/// false and returns empty values.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : rest_(bytes) {}

  template <std::unsigned_integral Number>
  Number number() {
    Number value{};
    const std::string_view bytes = raw(sizeof value);
    if (bytes.size() == sizeof value) std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }
  std::string_view raw(std::uint64_t length) {
    if (length > rest_.size()) {
      good_ = false;
      rest_ = {};
    }
    const std::string_view bytes = rest_.substr(0, length);
    rest_.remove_prefix(bytes.size());
    return bytes;
  }
  /// Reads bytes preceded by their length.
  template <std::unsigned_integral Length>
  std::string_view sized() {
    return raw(number<Length>());
  }
  std::string_view text() { return sized<std::uint32_t>(); }
  /// Reads each value: an unsigned number or a text.
  void take(auto&... values) {
    const auto one = [this]<typename Value>(Value& value) {
      if constexpr (std::unsigned_integral<Value>) {
        value = number<Value>();
      } else {
        value = text();
      }
    };
    (one(values), ...);
  }

  bool good() const { return good_; }
  bool atEnd() const { return rest_.empty(); }
  std::size_t left() const { return rest_.size(); }

 private:
  std::string_view rest_;
  bool good_ = true;
};

// What reading a file may take at most, whatever the file contains; every program that reads traces reads
// them through these limits. Memory and time are limited per byte of the file, so that a small file can
// neither fill nor stop a computer. Traces stay a tenth of that or less: a second of them takes 70 kB, and
// 0.7 MB decompressed.

// Larger ones are not written.
inline constexpr std::size_t kMaxMessageBytes = 4 << 20;
inline constexpr std::size_t kMaxAttachmentBytes = 65 << 20;
// Larger ones are rejected when read, before memory is allocated for them. Other programs write larger chunks
// and records than this one.
inline constexpr std::size_t kMaxChunkBytes = 64 << 20;    ///< uncompressed
inline constexpr std::size_t kMaxRecordBytes = 320 << 20;  ///< attachments of other programs may be large

/// Held at a time, or kept of the file, for each byte of it.
inline constexpr std::uint64_t kMaxHeldRatio = 256;
/// Decompressed of the file altogether, for each byte of it. Equal label images in records of fixtures take
/// next to nothing.
inline constexpr std::uint64_t kMaxUnpackedRatio = 4096;
/// A chunk that would become shorter by more than that is written as it is.
inline constexpr std::size_t kMaxWrittenRatio = 2048;

/// The largest size of a chunk in a file of that size. One that hapticd writes has at most two messages of
/// the largest size.
constexpr std::uint64_t mostInChunk(std::uint64_t file_bytes) {
  constexpr std::uint64_t kMin = 16 << 20;
  return std::min<std::uint64_t>(kMaxChunkBytes, kMin + kMaxHeldRatio * file_bytes);
}

/// What may be kept of the records of a file of that size altogether.
constexpr std::uint64_t mostKept(std::uint64_t file_bytes) {
  constexpr std::uint64_t kMin = 1 << 20;
  return kMin + kMaxHeldRatio * file_bytes;
}

/// What the chunks of one file may become when they are decompressed, in one pass.
/// Thread: one.
class Allowance {
 public:
  explicit Allowance(std::uint64_t file_bytes)
      : chunk_bytes_(mostInChunk(file_bytes)), left_(kMin + kMaxUnpackedRatio * file_bytes) {}

  /// The largest chunk.
  std::uint64_t chunkBytes() const { return chunk_bytes_; }
  /// Whether a chunk of this content is allowed. `messages`: in it; each costs time, however short it is.
  bool take(std::uint64_t bytes, std::uint64_t messages) {
    const std::uint64_t cost = bytes + kPerMessage * messages;
    const bool allowed = cost <= left_;
    left_ -= allowed ? cost : left_;
    return allowed;
  }

 private:
  static constexpr std::uint64_t kMin = 16 << 20;
  static constexpr std::uint64_t kPerMessage = 512;

  std::uint64_t chunk_bytes_;
  std::uint64_t left_;
};

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};
inline constexpr std::size_t kRecordHeadBytes = 9;  ///< opcode and length
inline constexpr std::uint64_t kFooterBytes = 20;   ///< length of the footer's content

/// Record types of MCAP.
enum class Opcode : std::uint8_t {
  header = 1,
  footer = 2,
  schema = 3,
  channel = 4,
  message = 5,
  chunk = 6,
  message_index = 7,
  chunk_index = 8,
  attachment = 9,
  attachment_index = 10,
  statistics = 11,
  metadata = 12,
  metadata_index = 13,
  summary_offset = 14,
  data_end = 15,
};

/// Computes the CRC-32 of IEEE 802.3, as in zlib. `before`: the CRC of the preceding bytes.
inline std::uint32_t crcOf(std::string_view bytes, std::uint32_t before = 0) {
  return drivers::crc32Of<0xEDB88320>(std::as_bytes(std::span(bytes)), before);
}

/// Appends a record with the content that `fill` appends.
template <typename Fill>
void addRecord(std::string& to, Opcode opcode, Fill fill) {
  to.push_back(static_cast<char>(opcode));
  ByteWriter(to).sized<std::uint64_t>(fill);
}

/// Names and values, as channels and metadata have them.
using TextPairs = std::span<const std::pair<std::string, std::string>>;

/// Append a Schema or Channel record (encodings ros2msg and cdr). `id`: its id; `schema`: the id of the
/// channel's schema.
void addSchema(std::string& to, std::uint16_t id, std::string_view name, std::string_view text);
void addChannel(std::string& to, std::uint16_t id, std::uint16_t schema, std::string_view topic,
                TextPairs metadata = {});

/// Appends names and values, preceded by their length in bytes.
void addPairs(std::string& to, TextPairs pairs);

/// A decoded Message record.
struct MessageRecord {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  std::uint64_t time_ns = 0;
  std::uint64_t publish_time_ns = 0;
  std::string_view data;

  /// Decodes a record; returns false if it is invalid.
  static bool of(std::string_view content, MessageRecord& message);
};

/// Entry of a message index: time of the message and its offset in the uncompressed chunk.
using MessagePlace = std::pair<std::uint64_t, std::uint64_t>;

/// Content of a chunk.
struct ChunkContent {
  std::uint64_t start_ns = 0;  ///< time of the earliest message
  std::uint64_t end_ns = 0;
  std::map<std::uint16_t, std::vector<MessagePlace>> messages;  ///< by channel, in the order of the chunk
  bool defines = false;  ///< holds schemas or channels, as chunks of other programs do

  /// Analyses uncompressed records; returns false if a chunk may not contain them.
  static bool of(std::string_view records, ChunkContent& content);
  /// Returns the MessageIndex records that follow the chunk.
  std::string indexRecords() const;
};

/// Calls visit(opcode, content, offset) for consecutive records in `records` until it returns false. Returns
/// false in that case or if a record is incomplete.
template <typename Visit>
bool visitRecords(std::string_view records, Visit visit) {
  for (ByteReader reader(records); !reader.atEnd();) {
    const std::uint64_t offset = records.size() - reader.left();
    const auto opcode = static_cast<Opcode>(reader.number<std::uint8_t>());
    const auto content = reader.sized<std::uint64_t>();
    if (!reader.good() || !visit(opcode, content, offset)) return false;
  }
  return true;
}

/// Returns true for record types that a chunk may contain besides messages: definitions, and records added by
/// later versions of the format or private extensions.
bool mayBeInChunk(Opcode opcode);

/// A decoded Chunk record.
struct ChunkRecord {
  std::uint64_t start_ns = 0;
  std::uint64_t end_ns = 0;
  std::uint64_t uncompressed_bytes = 0;
  std::uint32_t crc = 0;
  std::string_view compression;
  std::string_view records;  ///< as stored in the file
  std::size_t bytes = 0;     ///< of the content; what follows are fields of a later version of the format

  /// Decodes a record; returns false if it is invalid.
  static bool of(std::string_view content, ChunkRecord& chunk);
  /// Decompresses the records and verifies their checksum, if there is one. Returns a description of the
  /// fault, or "".
  std::string unpack(std::string& unpacked, Allowance& allowance) const;
};

/// Compresses the records of a chunk to `to`; returns false if they are to be stored as they are: compression
/// gains nothing, or so much that readers would not expect it.
bool compressRecords(Compressor& compressor, std::string_view records, std::string& to);

/// Appends a Chunk record.
void addChunk(std::string& to, const ChunkRecord& chunk);

/// A decoded Metadata record.
struct MetadataRecord {
  std::string_view name;
  std::vector<std::pair<std::string, std::string>> pairs;
  std::size_t bytes = 0;  ///< see ChunkRecord

  /// Decodes a record; returns false if it is invalid.
  static bool of(std::string_view content, MetadataRecord& metadata);
};

/// A decoded Attachment record.
struct AttachmentRecord {
  std::uint64_t log_time_ns = 0;
  std::uint64_t create_time_ns = 0;
  std::string_view name;
  std::string_view media_type;
  std::string_view data;
  std::uint32_t crc = 0;  ///< 0: it has no checksum
  std::size_t bytes = 0;  ///< see ChunkRecord

  /// Decodes a record. Returns a description of its fault, or "".
  static std::string of(std::string_view content, AttachmentRecord& attachment);
};

/// A channel with its schema.
struct Channel {
  std::uint16_t id = 0;
  std::string_view topic;
  std::string_view encoding;
  std::string_view schema_name;
  std::string_view schema_encoding;
  std::string_view schema;
};

/// A decoded Schema record.
struct SchemaRecord {
  std::uint16_t id = 0;
  std::string_view name;
  std::string_view encoding;
  std::string_view text;
  std::size_t bytes = 0;  ///< of the content; what follows are fields of a later version of the format

  /// Decodes a record; returns false if it is invalid.
  static bool of(std::string_view content, SchemaRecord& schema);
};

/// A decoded Channel record.
struct ChannelRecord {
  std::uint16_t id = 0;
  std::uint16_t schema = 0;  ///< id of its schema; 0: none
  std::string_view topic;
  std::string_view encoding;
  std::size_t bytes = 0;  ///< see SchemaRecord

  /// Decodes a record; returns false if it is invalid.
  static bool of(std::string_view content, ChannelRecord& channel);
};

/// The schemas and channels of a file, which may repeat them.
/// Thread: one.
class Definitions {
 public:
  // `content`: of the record. Return a description of its fault, or "".
  std::string addSchema(std::string_view content);
  std::string addChannel(std::string_view content);

  bool hasChannel(std::uint16_t id) const { return channels_.contains(id); }
  /// Returns an existing channel.
  Channel channel(std::uint16_t id) const;

 private:
  // contents of the records by id
  std::map<std::uint16_t, std::string> schemas_;
  std::map<std::uint16_t, std::string> channels_;
};

/// Collects the information for the summary at the end of a file.
class Summary {
 public:
  // `offset`, `bytes`: of the complete record in the file; `content`: of the record, each once
  /// Adds a schema, a channel, metadata or an attachment.
  void add(Opcode opcode, std::uint64_t offset, std::string_view content);
  void addChunk(std::uint64_t offset, std::uint64_t bytes, const ChunkRecord& chunk,
                const ChunkContent& content);
  void addAttachment(std::uint64_t offset, std::uint64_t bytes, const AttachmentRecord& attachment);

  std::uint64_t chunks() const { return chunks_; }

  /// Returns DataEnd, summary, footer and magic for a data section that ends at `offset`. `crc`: of
  /// everything before.
  std::string ending(std::uint64_t offset, std::uint32_t crc) const;

 private:
  void addMetadata(std::uint64_t offset, std::string_view content);
  std::string statistics() const;

  std::vector<std::string> schemas_;  ///< contents of the records
  std::vector<std::string> channels_;
  std::string chunk_indexes_;  ///< complete records
  std::string attachment_indexes_;
  std::string metadata_indexes_;
  std::map<std::uint16_t, std::uint64_t> messages_;  ///< number by channel
  std::uint64_t start_ns_ = 0;
  std::uint64_t end_ns_ = 0;
  std::uint32_t chunks_ = 0;
  std::uint32_t attachments_ = 0;
  std::uint32_t metadata_ = 0;
};

}  // namespace hapticd::trace::mcap
