// SPDX-License-Identifier: Apache-2.0
#include "drivers/trace/mcap/mcap_definitions.h"

#include <fmt/format.h>

#include "drivers/trace/mcap/bytes.h"

namespace hapticd::drivers::mcap {
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

}  // namespace hapticd::drivers::mcap
