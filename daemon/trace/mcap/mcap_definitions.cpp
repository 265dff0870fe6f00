// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/mcap/mcap_definitions.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "daemon/trace/mcap/mcap_format.h"

namespace hapticd::trace::mcap {
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
  schema.id = reader.number<std::uint16_t>();
  schema.name = reader.text();
  schema.encoding = reader.text();
  schema.text = reader.text();
  schema.bytes = content.size() - reader.left();
  return reader.good() && schema.id != 0;
}

bool ChannelRecord::of(std::string_view content, ChannelRecord& channel) {
  ByteReader reader(content);
  channel.id = reader.number<std::uint16_t>();
  channel.schema = reader.number<std::uint16_t>();
  channel.topic = reader.text();
  channel.encoding = reader.text();
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
    writer.number(content.start_ns);
    writer.number(content.end_ns);
    writer.number(offset);
    writer.number(bytes);
    std::uint64_t index_at = offset + bytes;
    writer.sized<std::uint32_t>([&] {
      for (const auto& [channel, places] : content.messages) {
        writer.number(channel);
        writer.number(index_at);
        index_at += kIndexHeadBytes + places.size() * kPlaceBytes;
      }
    });
    writer.number(index_at - offset - bytes);
    writer.text(chunk.compression);
    writer.number(std::uint64_t{chunk.records.size()});
    writer.number(chunk.uncompressed_bytes);
  });
  for (const auto& [channel, places] : content.messages) messages_[channel] += places.size();
  start_ns_ = chunks_ == 0 ? content.start_ns : std::min(start_ns_, content.start_ns);
  end_ns_ = std::max(end_ns_, content.end_ns);
  ++chunks_;
}

void Summary::addAttachment(std::uint64_t offset, std::uint64_t bytes, const AttachmentRecord& attachment) {
  ByteWriter writer(attachment_indexes_);
  addRecord(attachment_indexes_, Opcode::attachment_index, [&] {
    writer.number(offset);
    writer.number(bytes);
    writer.number(attachment.log_time_ns);
    writer.number(attachment.create_time_ns);
    writer.number(std::uint64_t{attachment.data.size()});
    writer.text(attachment.name);
    writer.text(attachment.media_type);
  });
  ++attachments_;
}

void Summary::addMetadata(std::uint64_t offset, std::string_view content) {
  ByteWriter writer(metadata_indexes_);
  addRecord(metadata_indexes_, Opcode::metadata_index, [&] {
    writer.number(offset);
    writer.number(std::uint64_t{kRecordHeadBytes + content.size()});
    writer.text(ByteReader(content).text());
  });
  ++metadata_;
}

std::string Summary::statistics() const {
  std::string record;
  ByteWriter writer(record);
  addRecord(record, Opcode::statistics, [&] {
    writer.number(std::accumulate(messages_.begin(), messages_.end(), std::uint64_t{0},
                                  [](std::uint64_t sum, const auto& entry) { return sum + entry.second; }));
    writer.number(static_cast<std::uint16_t>(schemas_.size()));
    writer.number(static_cast<std::uint32_t>(channels_.size()));
    writer.number(attachments_);
    writer.number(metadata_);
    writer.number(chunks_);
    writer.number(start_ns_);
    writer.number(end_ns_);
    writer.sized<std::uint32_t>([&] {
      for (const auto& [channel, count] : messages_) {
        writer.number(channel);
        writer.number(count);
      }
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
                ByteWriter writer(offsets);
                writer.number(static_cast<std::uint8_t>(opcode));
                writer.number(start + summary.size());
                writer.number(std::uint64_t{records.size()});
              });
    summary += records;
  }
  const std::uint64_t offsets_at = start + summary.size();
  summary += offsets;
  ByteWriter footer(summary);
  footer.number(static_cast<std::uint8_t>(Opcode::footer));
  footer.number(kFooterBytes);
  footer.number(start);
  footer.number(offsets_at);
  footer.number(crcOf(summary));  // of the summary up to here
  return data_end + summary + std::string(kMagic);
}

}  // namespace hapticd::trace::mcap
