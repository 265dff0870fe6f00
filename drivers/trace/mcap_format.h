// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/base/crc32.h"
#include "drivers/trace/bytes.h"

/// The container format MCAP (mcap.dev/spec, version 0): what writer, reader and recovery share.
namespace hapticd::drivers::mcap {

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};
inline constexpr std::size_t kRecordHeadBytes = 9;  ///< opcode and length
inline constexpr std::uint64_t kFooterBytes = 20;   ///< content of the footer

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

// What is longer is not written.
inline constexpr std::size_t kMostMessageBytes = 4 << 20;
inline constexpr std::size_t kMostAttachmentBytes = 32 << 20;
// What is longer is refused when it is read, before memory is taken for it. Other programs write longer
// chunks and records than this one.
inline constexpr std::size_t kMostChunkBytes = 256 << 20;   ///< uncompressed
inline constexpr std::size_t kMostRecordBytes = 320 << 20;  ///< a chunk that compression made longer, too

/// IEEE 802.3, as in zlib. `before`: of what comes before.
inline std::uint32_t crcOf(std::string_view bytes, std::uint32_t before = 0) {
  return crc32Of<0xEDB88320>(std::as_bytes(std::span(bytes)), before);
}

/// Appends a record whose content is what `fill` appends.
template <typename Fill>
void addRecord(std::string& to, Opcode opcode, Fill fill) {
  to.push_back(static_cast<char>(opcode));
  ByteWriter(to).sized<std::uint64_t>(fill);
}

void addSchema(std::string& to, std::uint16_t id, std::string_view name, std::string_view text);
void addChannel(std::string& to, std::uint16_t id, std::uint16_t schema, std::string_view topic);

/// A Message record taken apart.
struct MessageRecord {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  std::uint64_t time_ns = 0;
  std::uint64_t publish_time_ns = 0;
  std::string_view data;

  /// False: it is none.
  static bool of(std::string_view content, MessageRecord& message);
};

/// One place of a message: its time and its offset in the uncompressed chunk.
using MessagePlace = std::pair<std::uint64_t, std::uint64_t>;

/// What is in a chunk.
struct ChunkContent {
  std::uint64_t start_ns = 0;  ///< of the earliest message
  std::uint64_t end_ns = 0;
  std::map<std::uint16_t, std::vector<MessagePlace>> messages;  ///< by channel, in the order of the chunk
  // contents of the records
  std::vector<std::string_view> schemas;
  std::vector<std::string_view> channels;

  /// Looks through the uncompressed records. False: they are not what a chunk may hold.
  static bool of(std::string_view records, ChunkContent& content);
  /// The MessageIndex records that belong behind the chunk.
  std::string indexRecords() const;
};

/// Calls visit(opcode, content, offset) for the records that follow each other in `records`, until it returns
/// false. False: it did, or they are not whole.
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

/// True for what a chunk may hold beside messages: definitions, and records that later versions of the format
/// or private extensions add.
bool mayBeInChunk(Opcode opcode);

/// A Chunk record taken apart.
struct ChunkRecord {
  std::uint64_t start_ns = 0;
  std::uint64_t end_ns = 0;
  std::uint64_t uncompressed_bytes = 0;
  std::uint32_t crc = 0;
  std::string_view compression;
  std::string_view records;  ///< as they are in the file

  /// False: it is none.
  static bool of(std::string_view content, ChunkRecord& chunk);
  /// The uncompressed records, with their checksum where there is one. What is wrong with them, or "".
  std::string unpack(std::string& unpacked) const;
};

void addChunk(std::string& to, const ChunkRecord& chunk);

/// An Attachment record taken apart.
struct AttachmentRecord {
  std::uint64_t log_time_ns = 0;
  std::uint64_t create_time_ns = 0;
  std::string_view name;
  std::string_view media_type;
  std::string_view data;

  /// What is wrong with it, or "".
  static std::string of(std::string_view content, AttachmentRecord& attachment);
};

}  // namespace hapticd::drivers::mcap
