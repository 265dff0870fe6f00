// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <expected>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/trace/mcap/mcap_definitions.h"
#include "daemon/trace/mcap/mcap_format.h"
#include "daemon/trace/mcap/mcap_scanner.h"

namespace hapticd::trace::mcap {

/// A part of a file with messages: a chunk, or consecutive messages outside of chunks.
struct Stretch {
  std::uint64_t offset = 0;  ///< in the file
  std::uint64_t bytes = 0;
  std::uint64_t start_ns = 0;  ///< of its earliest message, according to the file
  bool chunk = false;

  std::uint64_t end() const { return offset + bytes; }
};

/// Receives the records found by a survey. Its functions return a description of the record's fault, or "".
class SurveyVisitor {
 public:
  virtual ~SurveyVisitor() = default;
  virtual std::string definition(const Record& record) = 0;  ///< a schema or channel outside of chunks
  virtual std::string companion(const Record& record) = 0;   ///< metadata or an attachment
};

/// Locations of the messages of a file.
struct Survey {
  std::vector<Stretch> stretches;  ///< in file order
  std::optional<Fault> fault;      ///< reason why the survey ended before the end of the data

  bool inOrderOfTime() const;
};

/// Visits the records of the data section without reading the content of chunks and messages. It is needed
/// because other programs write metadata after the messages, and chunks in any order.
Survey survey(Scanner& scanner, SurveyVisitor& visitor);

/// Merges the messages of parts of a file that overlap in time into the order of their times; messages with
/// the same time keep their order in the file.
/// Thread: one.
class Merger {
 public:
  /// Adds records; those other than messages are skipped. `offset`: of the part in the file.
  void add(std::uint64_t offset, std::string records);
  /// Returns the next message whose time is not after `until_ns`; false if there is none. Valid until the
  /// next call.
  bool next(std::uint64_t until_ns, MessageRecord& message);
  /// Returns the size of the messages held because later ones in the file may be earlier in time.
  std::size_t bytes() const { return bytes_; }

 private:
  struct Stretch {
    std::uint64_t offset = 0;
    std::unique_ptr<const std::string> records;
    std::vector<MessagePlace> messages;  ///< sorted by time
    std::size_t next = 0;
  };
  static bool isLater(const Stretch& a, const Stretch& b);

  std::vector<Stretch> stretches_;           ///< a heap with the earliest message first
  std::unique_ptr<const std::string> last_;  ///< owner of the last message, if it is no longer in a part
  std::size_t bytes_ = 0;
};

using Pairs = std::vector<std::pair<std::string, std::string>>;

/// A message with the id of its channel.
struct Message {
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
/// chunks, then the messages in the order of their times, each after its channel.
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
  /// Called for each chunk of `size` bytes at `offset`.
  virtual void chunk(std::uint64_t offset, std::uint64_t size) = 0;
  /// Returns true to stop reading.
  virtual bool enough() const = 0;
  /// Returns the reason for stopping if the file is unsuitable.
  virtual std::optional<Refusal> refusal() const { return {}; }
};

/// Reads a file from beginning to end, or until enough(), and verifies all checksums present. Any file
/// permitted by the specification is read: with or without chunks, compressed with lz4, zstd or not at all,
/// in any order, with or without a summary. Memory: one record, the uncompressed chunks that overlap in time
/// (limited regardless of the file's content), and the schemas.
std::expected<void, Fault> read(const std::filesystem::path& file, Visitor& visitor);

}  // namespace hapticd::trace::mcap
