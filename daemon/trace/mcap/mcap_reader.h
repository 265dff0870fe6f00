// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <expected>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/trace/mcap/mcap_definitions.h"
#include "daemon/trace/mcap/mcap_format.h"
#include "daemon/trace/mcap/mcap_scanner.h"

namespace hapticd::trace::mcap {

using Pairs = std::vector<std::pair<std::string, std::string>>;

/// A message with the id of its channel.
struct Message {
  std::uint64_t offset = 0;  ///< in the file, of its record or of the chunk that holds it
  std::uint16_t channel = 0;
  std::uint64_t time_ns = 0;          ///< log time
  std::uint64_t publish_time_ns = 0;  ///< not later in what hapticd writes
  std::string_view data;
};

/// Reason of a visitor to reject a valid file.
struct Refusal {
  std::string what;
  std::string remedy;
};

/// Receives the content of a file: first the metadata and attachments and the channels defined outside of
/// chunks, then the messages in the order of the file, each after its channel.
class Visitor {
 public:
  virtual ~Visitor() = default;
  virtual void metadata(std::string_view name, Pairs pairs) = 0;
  virtual void attachment(const AttachmentRecord& attachment) = 0;
  /// Called once per channel; several may have the same topic.
  virtual void channel(const Channel& channel) = 0;
  /// Called before the first message; after it, only messages and channels defined in chunks follow.
  virtual void messages() {}
  /// Processes a message. Returns a description of its fault, or "".
  virtual std::string message(const Message& message) = 0;
  /// Called for each chunk at `offset` of a file of `size` bytes, before its messages.
  virtual void chunk(std::uint64_t offset, std::uint64_t size) = 0;
  /// Returns true to stop reading.
  virtual bool enough() const = 0;
  /// Returns the reason for stopping if the file is unsuitable.
  virtual std::optional<Refusal> refusal() const { return {}; }
};

/// Reads a file from beginning to end, or until enough(), and verifies all checksums present. Any file
/// permitted by the specification is read: with or without chunks, compressed with lz4, zstd or not at all,
/// with or without a summary. Memory: one record, one uncompressed chunk, and the schemas.
std::expected<void, Fault> read(const std::filesystem::path& file, Visitor& visitor);

}  // namespace hapticd::trace::mcap
