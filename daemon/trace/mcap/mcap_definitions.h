// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/trace/mcap/mcap_format.h"

namespace hapticd::trace::mcap {

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
