#pragma once

#include <cstdint>
#include <expected>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/trace/mcap_scanner.h"

namespace hapticd::drivers::mcap {

using Pairs = std::vector<std::pair<std::string, std::string>>;

/// A channel with its schema.
struct Channel {
  std::uint16_t id = 0;
  std::string_view topic;
  std::string_view encoding;
  std::string_view schema_name;
  std::string_view schema_encoding;
  std::string_view schema;
};

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

/// Gets the content of a file in its order.
class Visitor {
 public:
  virtual ~Visitor() = default;
  virtual void channel(const Channel& channel) = 0;
  /// Returns what is wrong, "" if nothing is.
  virtual std::string message(const Message& message) = 0;
  virtual void metadata(std::string_view name, Pairs pairs) = 0;
  virtual void attachment(const AttachmentRecord& attachment) = 0;
  /// A chunk begins at `offset` of `size` bytes.
  virtual void chunk(std::uint64_t offset, std::uint64_t size) = 0;
  /// Nothing more is wanted.
  virtual bool enough() const = 0;
  /// Why that is so, where it is the file's fault.
  virtual std::optional<Refusal> refusal() const { return {}; }
};

/// Reads a file from its begin to its end, or until it is enough, with all checksums; each must be there.
/// Memory: a record and an uncompressed chunk, of bounded size whatever the file says, and schemas.
std::expected<void, Fault> read(const std::filesystem::path& file, Visitor& visitor);

}  // namespace hapticd::drivers::mcap
