#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/handle/crc32.h"
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

// What is longer is not written, and refused when it is read, before memory is taken for it.
inline constexpr std::size_t kMostMessageBytes = 4 << 20;
inline constexpr std::size_t kMostChunkBytes = 2 * kMostMessageBytes + (1 << 20);  ///< uncompressed
inline constexpr std::size_t kMostRecordBytes = 64 << 20;

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

/// One place of a message: its time and its offset in the uncompressed chunk.
using MessagePlace = std::pair<std::uint64_t, std::uint64_t>;

/// What is in a chunk.
struct ChunkContent {
  std::uint64_t start_ns = 0;  ///< of the earliest message
  std::uint64_t end_ns = 0;
  std::map<std::uint16_t, std::vector<MessagePlace>> messages;  ///< by channel, in the order of the chunk

  /// Looks through the uncompressed records. False: they are not only whole messages.
  static bool of(std::string_view records, ChunkContent& content);
  /// The MessageIndex records that belong behind the chunk.
  std::string indexRecords() const;
};

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
  /// The uncompressed records, in the file or in `buffer`. What is wrong with them, or "".
  std::string unpack(std::string& buffer, std::string_view& unpacked) const;
};

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

/// What the end of a file says of all before it.
class Summary {
 public:
  // `content`: of the record; what is there already is not added again
  void addSchema(std::string_view content) { addOnce(schemas_, content); }
  void addChannel(std::string_view content) { addOnce(channels_, content); }
  // `offset`, `bytes`: of the whole record in the file
  void addChunk(std::uint64_t offset, std::uint64_t bytes, const ChunkRecord& chunk,
                const ChunkContent& content);
  void addAttachment(std::uint64_t offset, std::uint64_t bytes, const AttachmentRecord& attachment);
  void addMetadata(std::uint64_t offset, std::uint64_t bytes, std::string_view content);

  std::uint64_t chunks() const { return chunks_; }

  /// DataEnd, summary, footer and magic for a data section that ends at `offset`. `crc`: of all before it.
  std::string ending(std::uint64_t offset, std::uint32_t crc) const;

 private:
  static void addOnce(std::vector<std::string>& to, std::string_view content);
  std::string statistics() const;

  std::vector<std::string> schemas_;  ///< contents of the records
  std::vector<std::string> channels_;
  std::string chunk_indexes_;  ///< whole records
  std::string attachment_indexes_;
  std::string metadata_indexes_;
  std::map<std::uint16_t, std::uint64_t> messages_;  ///< by channel
  std::uint64_t start_ns_ = 0;
  std::uint64_t end_ns_ = 0;
  std::uint32_t chunks_ = 0;
  std::uint32_t attachments_ = 0;
  std::uint32_t metadata_ = 0;
};

}  // namespace hapticd::drivers::mcap
