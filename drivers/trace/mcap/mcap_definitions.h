// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

namespace hapticd::drivers::mcap {

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

}  // namespace hapticd::drivers::mcap
