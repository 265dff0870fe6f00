// SPDX-License-Identifier: Apache-2.0
#include "drivers/trace/mcap/mcap_format.h"

#include <fmt/format.h>

#include <algorithm>

#include "config/base/value_text.h"

namespace hapticd::drivers::mcap {

void addSchema(std::string& to, std::uint16_t id, std::string_view name, std::string_view text) {
  addRecord(to, Opcode::schema, [&] {
    ByteWriter writer(to);
    writer.number(id);
    writer.text(name);
    writer.text("ros2msg");
    writer.text(text);
  });
}

void addChannel(std::string& to, std::uint16_t id, std::uint16_t schema, std::string_view topic) {
  addRecord(to, Opcode::channel, [&] {
    ByteWriter writer(to);
    writer.number(id);
    writer.number(schema);
    writer.text(topic);
    writer.text("cdr");
    writer.number(std::uint32_t{0});  // no metadata
  });
}

bool MessageRecord::of(std::string_view content, MessageRecord& message) {
  ByteReader reader(content);
  message.channel = reader.number<std::uint16_t>();
  message.sequence = reader.number<std::uint32_t>();
  message.time_ns = reader.number<std::uint64_t>();
  message.publish_time_ns = reader.number<std::uint64_t>();
  message.data = reader.raw(reader.left());
  return reader.good();
}

bool mayBeInChunk(Opcode opcode) {
  return opcode == Opcode::schema || opcode == Opcode::channel || opcode > Opcode::data_end;
}

bool ChunkContent::of(std::string_view records, ChunkContent& content) {
  content = {};
  bool first = true;
  return visitRecords(records, [&](Opcode opcode, std::string_view record, std::uint64_t offset) {
    content.defines |= opcode == Opcode::schema || opcode == Opcode::channel;
    if (mayBeInChunk(opcode)) return true;
    MessageRecord message;
    if (opcode != Opcode::message || !MessageRecord::of(record, message)) return false;
    content.start_ns = first ? message.time_ns : std::min(content.start_ns, message.time_ns);
    content.end_ns = std::max(content.end_ns, message.time_ns);
    content.messages[message.channel].emplace_back(message.time_ns, offset);
    first = false;
    return true;
  });
}

std::string ChunkContent::indexRecords() const {
  std::string records;
  ByteWriter writer(records);
  for (const auto& [channel, places] : messages) {
    addRecord(records, Opcode::message_index, [&] {
      writer.number(channel);
      writer.sized<std::uint32_t>([&] {
        for (const auto& [time_ns, offset] : places) {
          writer.number(time_ns);
          writer.number(offset);
        }
      });
    });
  }
  return records;
}

bool ChunkRecord::of(std::string_view content, ChunkRecord& chunk) {
  ByteReader reader(content);
  chunk.start_ns = reader.number<std::uint64_t>();
  chunk.end_ns = reader.number<std::uint64_t>();
  chunk.uncompressed_bytes = reader.number<std::uint64_t>();
  chunk.crc = reader.number<std::uint32_t>();
  chunk.compression = reader.text();
  chunk.records = reader.sized<std::uint64_t>();
  chunk.bytes = content.size() - reader.left();
  return reader.good();
}

namespace {

std::uint64_t messagesIn(std::string_view records) {
  std::uint64_t messages = 0;
  visitRecords(records, [&messages](Opcode opcode, std::string_view, std::uint64_t) {
    messages += opcode == Opcode::message ? 1 : 0;
    return true;
  });
  return messages;
}

}  // namespace

std::string ChunkRecord::unpack(std::string& unpacked, Allowance& allowance) const {
  if (uncompressed_bytes > allowance.chunkBytes()) {
    return fmt::format("a chunk of {} bytes; at most {} are accepted in a file of this size",
                       uncompressed_bytes, allowance.chunkBytes());
  }
  if (compression == "zstd") {
    if (!decompressZstd(records, uncompressed_bytes, unpacked)) return "the chunk cannot be decompressed";
  } else if (compression == "lz4") {
    if (!decompressLz4(records, uncompressed_bytes, unpacked)) return "the chunk cannot be decompressed";
  } else if (compression.empty()) {
    if (records.size() != uncompressed_bytes) return "the lengths of the chunk are inconsistent";
    unpacked = records;
  } else {
    return fmt::format("the chunk is compressed with {}; only lz4 and zstd are supported",
                       base::inQuotes(std::string(compression.substr(0, 20))));
  }
  if (crc != 0 && crcOf(unpacked) != crc) return "the checksum of the chunk does not match";
  if (allowance.take(unpacked.size(), messagesIn(unpacked))) return "";
  return fmt::format(
      "the chunks up to here hold more than {} bytes for each byte of the file, which no trace does",
      kMaxUnpackedRatio);
}

bool compressRecords(Compressor& compressor, std::string_view records, std::string& to) {
  return compressor.compress(records, to) && records.size() / kMaxWrittenRatio <= to.size();
}

void addChunk(std::string& to, const ChunkRecord& chunk) {
  addRecord(to, Opcode::chunk, [&] {
    ByteWriter writer(to);
    writer.number(chunk.start_ns);
    writer.number(chunk.end_ns);
    writer.number(chunk.uncompressed_bytes);
    writer.number(chunk.crc);
    writer.text(chunk.compression);
    writer.sized<std::uint64_t>([&] { writer.raw(chunk.records); });
  });
}

bool MetadataRecord::of(std::string_view content, MetadataRecord& metadata) {
  ByteReader reader(content);
  metadata.name = reader.text();
  ByteReader map(reader.text());
  metadata.bytes = content.size() - reader.left();
  metadata.pairs.clear();
  while (!map.atEnd()) {
    std::string key(map.text());
    metadata.pairs.emplace_back(std::move(key), map.text());
  }
  return reader.good() && map.good();
}

std::string AttachmentRecord::of(std::string_view content, AttachmentRecord& attachment) {
  ByteReader reader(content);
  attachment.log_time_ns = reader.number<std::uint64_t>();
  attachment.create_time_ns = reader.number<std::uint64_t>();
  attachment.name = reader.text();
  attachment.media_type = reader.text();
  attachment.data = reader.sized<std::uint64_t>();
  const std::size_t covered = content.size() - reader.left();
  attachment.crc = reader.number<std::uint32_t>();
  attachment.bytes = content.size() - reader.left();
  if (!reader.good()) return "an incomplete attachment";
  const bool matches = attachment.crc == 0 || attachment.crc == crcOf(content.substr(0, covered));
  return matches ? "" : "the checksum of an attachment does not match";
}

}  // namespace hapticd::drivers::mcap
