// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/mcap/mcap_format.h"

#include <fmt/format.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <optional>

#include "config/base/value_text.h"

namespace hapticd::trace {
namespace {

/// Collects the output of `step(room, length)`, which returns the number of bytes written, 0 at the end, or
/// nothing if the input is invalid.
template <typename Step>
bool collect(std::size_t length, std::string& to, Step step) {
  constexpr std::size_t kPieceBytes = 1 << 18;
  to.clear();
  while (true) {
    const std::size_t at = to.size();
    to.resize(at + std::min(kPieceBytes, length - at + 1));  // one byte more, to detect excess output
    const std::optional<std::size_t> written = step(to.data() + at, to.size() - at);
    if (!written) return false;
    to.resize(at + *written);
    if (to.size() > length) return false;
    if (*written == 0) return to.size() == length;
  }
}

}  // namespace

struct Compressor::Context {
  ZSTD_CCtx* zstd = ::ZSTD_createCCtx();
  ~Context() { ::ZSTD_freeCCtx(zstd); }
};

Compressor::Compressor() : context_(std::make_unique<Context>()) {}
Compressor::~Compressor() = default;

bool Compressor::compress(std::string_view bytes, std::string& to) {
  if (context_->zstd == nullptr || bytes.empty()) return false;
  to.resize(::ZSTD_compressBound(bytes.size()));
  const std::size_t length = ::ZSTD_compressCCtx(context_->zstd, to.data(), to.size(), bytes.data(),
                                                 bytes.size(), ZSTD_CLEVEL_DEFAULT);
  if (::ZSTD_isError(length) != 0 || length >= bytes.size()) return false;
  to.resize(length);
  return true;
}

bool decompressZstd(std::string_view bytes, std::size_t length, std::string& to) {
  const std::unique_ptr<ZSTD_DCtx, decltype(&::ZSTD_freeDCtx)> context(::ZSTD_createDCtx(), &::ZSTD_freeDCtx);
  if (!context) return false;
  ZSTD_inBuffer in{bytes.data(), bytes.size(), 0};
  std::size_t missing = 0;  // input still missing; 0 at the end of a frame
  return collect(length, to, [&](char* room, std::size_t size) -> std::optional<std::size_t> {
    ZSTD_outBuffer out{room, size, 0};
    while (out.pos == 0 && (missing != 0 || in.pos < in.size)) {
      const std::size_t before = in.pos;
      missing = ::ZSTD_decompressStream(context.get(), &out, &in);
      if (::ZSTD_isError(missing) != 0) return std::nullopt;
      const bool stuck = out.pos == 0 && in.pos == before;
      if (stuck && missing != 0) return std::nullopt;  // the last frame is truncated
    }
    return out.pos;
  });
}

bool decompressLz4(std::string_view bytes, std::size_t length, std::string& to) {
  LZ4F_dctx* created = nullptr;
  if (::LZ4F_isError(::LZ4F_createDecompressionContext(&created, LZ4F_VERSION)) != 0) return false;
  const std::unique_ptr<LZ4F_dctx, decltype(&::LZ4F_freeDecompressionContext)> context(
      created, &::LZ4F_freeDecompressionContext);
  std::size_t missing = 0;  // input still missing; 0 at the end of a frame
  return collect(length, to, [&](char* room, std::size_t size) -> std::optional<std::size_t> {
    std::size_t written = 0;
    while (written == 0 && (missing != 0 || !bytes.empty())) {
      std::size_t taken = bytes.size();
      written = size;
      missing = ::LZ4F_decompress(context.get(), room, &written, bytes.data(), &taken, nullptr);
      if (::LZ4F_isError(missing) != 0) return std::nullopt;
      if (written == 0 && taken == 0 && missing != 0) return std::nullopt;  // the last frame is truncated
      bytes.remove_prefix(taken);
    }
    return written;
  });
}

bool decompressUpTo(std::string_view bytes, std::size_t max_bytes, std::string& to) {
  const unsigned long long length = ::ZSTD_getFrameContentSize(bytes.data(), bytes.size());
  const bool known = length != ZSTD_CONTENTSIZE_UNKNOWN && length != ZSTD_CONTENTSIZE_ERROR;
  return known && length <= max_bytes && decompressZstd(bytes, length, to);
}

}  // namespace hapticd::trace

namespace hapticd::trace::mcap {

void addSchema(std::string& to, std::uint16_t id, std::string_view name, std::string_view text) {
  addRecord(to, Opcode::schema, [&] { ByteWriter(to).put(id, name, "ros2msg", text); });
}

void addPairs(std::string& to, TextPairs pairs) {
  ByteWriter writer(to);
  writer.sized<std::uint32_t>([&] {
    for (const auto& [key, value] : pairs) writer.put(key, value);
  });
}

void addChannel(std::string& to, std::uint16_t id, std::uint16_t schema, std::string_view topic,
                TextPairs metadata) {
  addRecord(to, Opcode::channel, [&] {
    ByteWriter(to).put(id, schema, topic, "cdr");
    addPairs(to, metadata);
  });
}

bool MessageRecord::of(std::string_view content, MessageRecord& message) {
  ByteReader reader(content);
  reader.take(message.channel, message.sequence, message.time_ns, message.publish_time_ns);
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
        for (const auto& [time_ns, offset] : places) writer.put(time_ns, offset);
      });
    });
  }
  return records;
}

bool ChunkRecord::of(std::string_view content, ChunkRecord& chunk) {
  ByteReader reader(content);
  reader.take(chunk.start_ns, chunk.end_ns, chunk.uncompressed_bytes, chunk.crc, chunk.compression);
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
    writer.put(chunk.start_ns, chunk.end_ns, chunk.uncompressed_bytes, chunk.crc, chunk.compression);
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
  reader.take(attachment.log_time_ns, attachment.create_time_ns, attachment.name, attachment.media_type);
  attachment.data = reader.sized<std::uint64_t>();
  const std::size_t covered = content.size() - reader.left();
  reader.take(attachment.crc);
  attachment.bytes = content.size() - reader.left();
  if (!reader.good()) return "an incomplete attachment";
  const bool matches = attachment.crc == 0 || attachment.crc == crcOf(content.substr(0, covered));
  return matches ? "" : "the checksum of an attachment does not match";
}

namespace {

/// Registers a definition; an id must always have the same content.
std::string define(std::map<std::uint16_t, std::string>& all, const char* what, std::uint16_t id,
                   std::string_view content) {
  const auto [place, is_new] = all.emplace(id, content);
  if (is_new || place->second == content) return "";
  return fmt::format("{} {} has two different definitions", what, id);
}

}  // namespace

bool SchemaRecord::of(std::string_view content, SchemaRecord& schema) {
  ByteReader reader(content);
  reader.take(schema.id, schema.name, schema.encoding, schema.text);
  schema.bytes = content.size() - reader.left();
  return reader.good() && schema.id != 0;
}

bool ChannelRecord::of(std::string_view content, ChannelRecord& channel) {
  ByteReader reader(content);
  reader.take(channel.id, channel.schema, channel.topic, channel.encoding);
  ByteReader metadata(reader.text());
  channel.bytes = content.size() - reader.left();
  while (!metadata.atEnd()) {
    metadata.text();
    metadata.text();
  }
  return reader.good() && metadata.good();
}

std::string Definitions::addSchema(std::string_view content) {
  SchemaRecord schema;
  if (!SchemaRecord::of(content, schema)) return "an incomplete schema";
  return define(schemas_, "schema", schema.id, content);
}

std::string Definitions::addChannel(std::string_view content) {
  ChannelRecord channel;
  if (!ChannelRecord::of(content, channel)) return "an incomplete channel";
  if (channel.schema != 0 && !schemas_.contains(channel.schema)) {
    return fmt::format("the schema of channel {} is missing", channel.id);
  }
  return define(channels_, "channel", channel.id, content);
}

Channel Definitions::channel(std::uint16_t id) const {
  ChannelRecord record;
  ChannelRecord::of(channels_.at(id), record);
  SchemaRecord schema;
  if (const auto found = schemas_.find(record.schema); found != schemas_.end()) {
    SchemaRecord::of(found->second, schema);
  }
  return {.id = id,
          .topic = record.topic,
          .encoding = record.encoding,
          .schema_name = schema.name,
          .schema_encoding = schema.encoding,
          .schema = schema.text};
}

void Summary::add(Opcode opcode, std::uint64_t offset, std::string_view content) {
  if (opcode == Opcode::schema) schemas_.emplace_back(content);
  if (opcode == Opcode::channel) channels_.emplace_back(content);
  if (opcode == Opcode::metadata) addMetadata(offset, content);
  AttachmentRecord attachment;
  if (opcode == Opcode::attachment && AttachmentRecord::of(content, attachment).empty()) {
    addAttachment(offset, kRecordHeadBytes + content.size(), attachment);
  }
}

void Summary::addChunk(std::uint64_t offset, std::uint64_t bytes, const ChunkRecord& chunk,
                       const ChunkContent& content) {
  constexpr std::size_t kIndexHeadBytes = kRecordHeadBytes + 2 + 4;  // channel id and length of the entries
  constexpr std::size_t kPlaceBytes = 16;
  ByteWriter writer(chunk_indexes_);
  addRecord(chunk_indexes_, Opcode::chunk_index, [&] {
    writer.put(content.start_ns, content.end_ns, offset, bytes);
    std::uint64_t index_at = offset + bytes;
    writer.sized<std::uint32_t>([&] {
      for (const auto& [channel, places] : content.messages) {
        writer.put(channel, index_at);
        index_at += kIndexHeadBytes + places.size() * kPlaceBytes;
      }
    });
    writer.put(index_at - offset - bytes, chunk.compression, std::uint64_t{chunk.records.size()},
               chunk.uncompressed_bytes);
  });
  for (const auto& [channel, places] : content.messages) messages_[channel] += places.size();
  start_ns_ = chunks_ == 0 ? content.start_ns : std::min(start_ns_, content.start_ns);
  end_ns_ = std::max(end_ns_, content.end_ns);
  ++chunks_;
}

void Summary::addAttachment(std::uint64_t offset, std::uint64_t bytes, const AttachmentRecord& attachment) {
  addRecord(attachment_indexes_, Opcode::attachment_index, [&] {
    ByteWriter(attachment_indexes_)
        .put(offset, bytes, attachment.log_time_ns, attachment.create_time_ns,
             std::uint64_t{attachment.data.size()}, attachment.name, attachment.media_type);
  });
  ++attachments_;
}

void Summary::addMetadata(std::uint64_t offset, std::string_view content) {
  addRecord(metadata_indexes_, Opcode::metadata_index, [&] {
    ByteWriter(metadata_indexes_)
        .put(offset, std::uint64_t{kRecordHeadBytes + content.size()}, ByteReader(content).text());
  });
  ++metadata_;
}

std::string Summary::statistics() const {
  std::string record;
  ByteWriter writer(record);
  addRecord(record, Opcode::statistics, [&] {
    writer.number(std::accumulate(messages_.begin(), messages_.end(), std::uint64_t{0},
                                  [](std::uint64_t sum, const auto& entry) { return sum + entry.second; }));
    writer.put(static_cast<std::uint16_t>(schemas_.size()), static_cast<std::uint32_t>(channels_.size()),
               attachments_, metadata_, chunks_, start_ns_, end_ns_);
    writer.sized<std::uint32_t>([&] {
      for (const auto& [channel, count] : messages_) writer.put(channel, count);
    });
  });
  return record;
}

std::string Summary::ending(std::uint64_t offset, std::uint32_t crc) const {
  const auto recordsOf = [](Opcode opcode, const std::vector<std::string>& contents) {
    std::string records;
    for (const std::string& content : contents) addRecord(records, opcode, [&] { records += content; });
    return records;
  };
  std::string data_end;
  addRecord(data_end, Opcode::data_end, [&] { ByteWriter(data_end).number(crc); });

  const std::uint64_t start = offset + data_end.size();
  const std::array<std::pair<Opcode, std::string>, 6> groups{
      {{Opcode::schema, recordsOf(Opcode::schema, schemas_)},
       {Opcode::channel, recordsOf(Opcode::channel, channels_)},
       {Opcode::statistics, statistics()},
       {Opcode::chunk_index, chunk_indexes_},
       {Opcode::attachment_index, attachment_indexes_},
       {Opcode::metadata_index, metadata_indexes_}}};
  std::string summary, offsets;
  for (const auto& [opcode, records] : groups) {
    if (records.empty()) continue;
    addRecord(offsets, Opcode::summary_offset,
              [&offsets, &summary, opcode = opcode, &records = records, start] {
                ByteWriter(offsets).put(static_cast<std::uint8_t>(opcode), start + summary.size(),
                                        std::uint64_t{records.size()});
              });
    summary += records;
  }
  const std::uint64_t offsets_at = start + summary.size();
  summary += offsets;
  ByteWriter footer(summary);
  footer.put(static_cast<std::uint8_t>(Opcode::footer), kFooterBytes, start, offsets_at);
  footer.number(crcOf(summary));  // of the summary up to here
  return data_end + summary + std::string(kMagic);
}

}  // namespace hapticd::trace::mcap
