// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/mcap/mcap_reader.h"

#include <fmt/format.h>

#include <limits>
#include <optional>
#include <string>
#include <utility>

namespace hapticd::trace::mcap {
namespace {

constexpr const char* kNotWhole = "an incomplete record";

/// Reads one file. Faults of a record or a part of it are returned as a text, or "" if there is none.
class Reading {
 public:
  Reading(Scanner scanner, Visitor& visitor)
      : scanner_(std::move(scanner)), visitor_(visitor), allowance_(scanner_.size()) {}

  std::expected<void, Fault> run() {
    const auto described = descriptions();
    visitor_.messages();
    if (const auto refused = refusal()) {
      // Required data may be in the unreadable part.
      return std::unexpected(described ? *refused : described.error());
    }
    scanner_.restart();
    return records();
  }

 private:
  // -- Definitions, metadata and attachments outside of chunks, which come before the messages --

  /// Reads them without the content of chunks and messages: other programs write metadata behind the
  /// messages.
  std::expected<void, Fault> descriptions() {
    while (true) {
      const auto head = scanner_.head();
      if (!head) return std::unexpected(head.error());
      if (head->opcode == Opcode::data_end || head->opcode == Opcode::footer) return {};
      if (!describes(head->opcode)) {
        scanner_.jump(head->end());
        continue;
      }
      const auto record = scanner_.next();
      if (!record) return std::unexpected(record.error());
      if (const std::string wrong = description(*record); !wrong.empty()) {
        return std::unexpected(scanner_.damaged(record->offset, wrong));
      }
    }
  }

  static bool describes(Opcode opcode) {
    return opcode == Opcode::schema || opcode == Opcode::channel || opcode == Opcode::metadata ||
           opcode == Opcode::attachment;
  }

  std::string description(const Record& record) {
    if (record.opcode == Opcode::metadata) return metadata(record.content);
    if (record.opcode == Opcode::attachment) return attachment(record.content);
    return define(record.opcode, record.content);
  }

  std::string define(Opcode opcode, std::string_view content) {
    if (opcode == Opcode::schema) return definitions_.addSchema(content);
    const std::uint16_t id = ByteReader(content).number<std::uint16_t>();
    const bool is_new = !definitions_.hasChannel(id);
    std::string wrong = definitions_.addChannel(content);
    if (wrong.empty() && is_new) visitor_.channel(definitions_.channel(id));
    return wrong;
  }

  std::string attachment(std::string_view content) {
    AttachmentRecord attachment;
    std::string wrong = AttachmentRecord::of(content, attachment);
    if (wrong.empty()) visitor_.attachment(attachment);
    return wrong;
  }

  std::string metadata(std::string_view content) {
    MetadataRecord metadata;
    if (!MetadataRecord::of(content, metadata)) return kNotWhole;
    visitor_.metadata(metadata.name, std::move(metadata.pairs));
    return "";
  }

  std::optional<Fault> refusal() const {
    const auto refusal = visitor_.refusal();
    if (!refusal) return {};
    return scanner_.foreign(refusal->what, refusal->remedy);
  }

  // -- All records and their checksums --

  std::expected<void, Fault> records() {
    while (!visitor_.enough()) {
      const auto record = scanner_.next();
      if (!record) return std::unexpected(record.error());
      if (const std::string wrong = take(*record); !wrong.empty()) {
        return std::unexpected(scanner_.damaged(record->offset, wrong));
      }
      if (const auto refused = refusal()) return std::unexpected(*refused);
      if (record->opcode != Opcode::footer) continue;
      if (const auto end = scanner_.atClosingMagic(); !end) return std::unexpected(end.error());
      return {};
    }
    return {};
  }

  std::string take(const Record& record) {
    const bool first = record.offset == kMagic.size();
    if (first != (record.opcode == Opcode::header)) return "the header is not at the beginning";
    if (summary_at_) return record.opcode == Opcode::footer ? footer(record) : "";
    switch (record.opcode) {
      case Opcode::schema:
      case Opcode::channel:
        // Repeated for chunks that use definitions from before them.
        return define(record.opcode, record.content);
      case Opcode::chunk:
        return chunk(record);
      case Opcode::message:
        return looseMessage(record);
      case Opcode::data_end:
        return dataEnd(record);
      case Opcode::footer:
        return "the DataEnd record is missing";
      default:
        return "";  // indexes, for readers in another order, and records of later versions
    }
  }

  std::string chunk(const Record& record) {
    std::string records;
    std::string wrong = unpack(record.content, records);
    if (!wrong.empty()) return wrong;
    visitor_.chunk(record.offset, scanner_.size());
    visitRecords(records, [&](Opcode opcode, std::string_view content, std::uint64_t) {
      if (opcode == Opcode::message) wrong = give(record.offset, content);
      return wrong.empty() && !visitor_.enough();
    });
    return wrong;
  }

  /// Decompresses and checks the records of a chunk and registers its definitions.
  std::string unpack(std::string_view content, std::string& records) {
    ChunkRecord chunk;
    if (!ChunkRecord::of(content, chunk)) return kNotWhole;
    if (std::string wrong = chunk.unpack(records, allowance_); !wrong.empty()) return wrong;
    std::string wrong;
    const bool whole = visitRecords(records, [&](Opcode opcode, std::string_view record, std::uint64_t) {
      if (opcode == Opcode::message) {
        wrong = checkMessage(record, chunk.start_ns, chunk.end_ns);
      } else if (opcode == Opcode::schema || opcode == Opcode::channel) {
        wrong = define(opcode, record);
      } else if (!mayBeInChunk(opcode)) {
        wrong = "a record type that a chunk may not contain";
      }
      return wrong.empty();
    });
    return whole ? "" : wrong.empty() ? kNotWhole : wrong;
  }

  std::string checkMessage(std::string_view content, std::uint64_t from_ns, std::uint64_t to_ns) const {
    MessageRecord message;
    if (!MessageRecord::of(content, message)) return kNotWhole;
    if (!definitions_.hasChannel(message.channel)) {
      return fmt::format("a message of channel {}, which is not defined", message.channel);
    }
    const bool within = message.time_ns >= from_ns && message.time_ns <= to_ns;
    return within ? "" : "a message whose time is outside the range of its chunk";
  }

  std::string looseMessage(const Record& record) {
    constexpr std::uint64_t kAnyTime = std::numeric_limits<std::uint64_t>::max();
    std::string wrong = checkMessage(record.content, 0, kAnyTime);
    return wrong.empty() ? give(record.offset, record.content) : wrong;
  }

  std::string give(std::uint64_t offset, std::string_view content) {
    MessageRecord message;
    MessageRecord::of(content, message);
    return visitor_.message(
        {offset, message.channel, message.time_ns, message.publish_time_ns, message.data});
  }

  std::string dataEnd(const Record& record) {
    ByteReader reader(record.content);
    const auto crc = reader.number<std::uint32_t>();
    if (!reader.good()) return kNotWhole;
    if (crc != 0 && crc != record.crc) return "the checksum of the data does not match";
    summary_at_ = scanner_.offset();
    scanner_.restartCrc();
    return "";
  }

  std::string footer(const Record& record) const {
    if (record.content.size() != kFooterBytes) return kNotWhole;
    ByteReader reader(record.content);
    const auto summary_at = reader.number<std::uint64_t>();
    reader.number<std::uint64_t>();  // offset of the summary offset section
    const auto crc = reader.number<std::uint32_t>();
    std::string head;
    addRecord(head, Opcode::footer, [&] { head += record.content; });
    const std::string_view covered = std::string_view(head).substr(0, head.size() - sizeof crc);
    if (summary_at != 0 && summary_at != summary_at_)
      return "the summary is not at the position given in the footer";
    if (crc != 0 && crc != crcOf(covered, record.crc)) return "the checksum of the summary does not match";
    return "";
  }

  Scanner scanner_;
  Visitor& visitor_;
  Allowance allowance_;
  Definitions definitions_;
  std::optional<std::uint64_t> summary_at_;
};

}  // namespace

std::expected<void, Fault> read(const std::filesystem::path& file, Visitor& visitor) {
  auto scanner = Scanner::open(file);
  if (!scanner) return std::unexpected(scanner.error());
  return Reading(std::move(*scanner), visitor).run();
}

}  // namespace hapticd::trace::mcap
