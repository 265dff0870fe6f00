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

#include "drivers/trace/mcap_definitions.h"
#include "drivers/trace/mcap_scanner.h"

namespace hapticd::drivers::mcap {

using Pairs = std::vector<std::pair<std::string, std::string>>;

struct Message {
  std::uint16_t channel = 0;
  std::uint64_t time_ns = 0;
  std::string_view data;
};

/// Why a file is not for the visitor, though nothing in it is wrong.
struct Refusal {
  std::string what;
  std::string remedy;
};

/// Gets the content of a file: first its metadata and attachments and the channels that are defined outside
/// of chunks, then the messages in the order of their times, each after its channel.
class Visitor {
 public:
  virtual ~Visitor() = default;
  virtual void metadata(std::string_view name, Pairs pairs) = 0;
  virtual void attachment(const AttachmentRecord& attachment) = 0;
  /// Once for each; several may have the same topic.
  virtual void channel(const Channel& channel) = 0;
  /// What follows are messages, and channels that are defined in chunks.
  virtual void messages() {}
  /// Returns what is wrong, "" if nothing is.
  virtual std::string message(const Message& message) = 0;
  /// A chunk begins at `offset` of `size` bytes.
  virtual void chunk(std::uint64_t offset, std::uint64_t size) = 0;
  /// Nothing more is wanted.
  virtual bool enough() const = 0;
  /// Why that is so, where it is the file's fault.
  virtual std::optional<Refusal> refusal() const { return {}; }
};

/// Reads a file from its begin to its end, or until it is enough, with all checksums that are there. Any file
/// that the specification allows is read: with chunks or without, compressed by lz4, zstd or not at all, in
/// any order, with or without a summary. Memory: a record and those uncompressed chunks that overlap in time,
/// of bounded size whatever the file says, and schemas.
std::expected<void, Fault> read(const std::filesystem::path& file, Visitor& visitor);

}  // namespace hapticd::drivers::mcap
