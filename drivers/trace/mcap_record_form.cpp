// SPDX-License-Identifier: Apache-2.0
#include "drivers/trace/mcap_record_form.h"

#include "drivers/trace/mcap_definitions.h"

namespace hapticd::drivers::mcap {
namespace {

constexpr std::size_t kMaxSummaryRecordBytes = 1 << 20;

bool isMetadata(std::string_view content) {
  ByteReader reader(content);
  reader.text();
  ByteReader map(reader.text());
  while (!map.atEnd()) {
    map.text();
    map.text();
  }
  return reader.good() && map.good() && reader.atEnd();
}

}  // namespace

bool MessageIndex::of(std::string_view content, MessageIndex& index) {
  ByteReader reader(content);
  index.channel = reader.number<std::uint16_t>();
  ByteReader places(reader.text());
  while (!places.atEnd()) {
    const auto time_ns = places.number<std::uint64_t>();
    index.places.emplace_back(time_ns, places.number<std::uint64_t>());
  }
  return reader.good() && places.good() && reader.atEnd();
}

bool hasForm(Opcode opcode, std::string_view content) {
  SchemaRecord schema;
  ChannelRecord channel;
  AttachmentRecord attachment;
  MessageIndex index;
  switch (opcode) {
    case Opcode::schema:
      return SchemaRecord::of(content, schema);
    case Opcode::channel:
      return ChannelRecord::of(content, channel);
    case Opcode::attachment:
      return AttachmentRecord::of(content, attachment).empty();
    case Opcode::metadata:
      return isMetadata(content);
    case Opcode::message_index:
      return MessageIndex::of(content, index);
    case Opcode::footer:
      return content.size() == kFooterBytes;
    case Opcode::data_end:
      return content.size() == sizeof(std::uint32_t);
    default:
      return content.size() < kMaxSummaryRecordBytes;  // part of the summary, which is rewritten
  }
}

std::string malformedText(Opcode opcode) {
  switch (opcode) {
    case Opcode::schema:
      return "an incomplete schema";
    case Opcode::channel:
      return "an incomplete channel";
    case Opcode::attachment:
      return "an incomplete attachment";
    case Opcode::metadata:
      return "incomplete metadata";
    default:
      return "an incomplete record";
  }
}

std::string unpackChunk(std::string_view content, Allowance& allowance, std::string& unpacked,
                        ChunkRecord& chunk, ChunkContent& inside) {
  if (!ChunkRecord::of(content, chunk)) return "an incomplete chunk";
  if (std::string wrong = chunk.unpack(unpacked, allowance); !wrong.empty()) return wrong;
  return ChunkContent::of(unpacked, inside) ? "" : "a chunk that contains something other than messages";
}

}  // namespace hapticd::drivers::mcap
