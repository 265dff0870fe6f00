// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/mcap/mcap_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <utility>

namespace hapticd::trace::mcap {
namespace {

std::unexpected<Fault> unreadable(base::Error error) {
  return std::unexpected(Fault{Fault::Kind::unreadable, std::move(error)});
}

Fault cut(const std::filesystem::path& file, std::uint64_t offset) {
  const std::string where = fmt::format("{} at byte {}", file.string(), offset);
  if (isBeingWritten(file)) {
    return {Fault::Kind::cut,
            {where, "the trace is still being written", "stop it first, e.g. with hapticctl trace stop"}};
  }
  return {Fault::Kind::cut,
          {where, "the trace is truncated",
           "hapticd or the machine stopped while it was written, or the copy is incomplete: hapticctl trace "
           "recover saves the intact parts to a new file"}};
}

}  // namespace

base::Error outOfMemory(const std::filesystem::path& file) {
  return {file.string(), "reading it takes more memory than there is",
          "end other programs, or read it on another computer"};
}

std::expected<Scanner, Fault> Scanner::open(const std::filesystem::path& path) {
  auto file = TraceFile::openToRead(path);
  if (!file) return unreadable(file.error());
  const auto size = file->size();
  if (!size) return unreadable(size.error());
  Scanner scanner(std::move(*file), *size);
  const auto magic = scanner.peek(kMagic.size());
  if (!magic) return std::unexpected(magic.error());
  if (!kMagic.starts_with(*magic)) {
    return std::unexpected(scanner.foreign("is not an MCAP file", "give a trace of hapticd"));
  }
  if (magic->size() < kMagic.size()) return std::unexpected(cut(path, magic->size()));
  scanner.skip(kMagic);
  return scanner;
}

Fault Scanner::damaged(std::uint64_t offset, std::string_view what) const {
  return {Fault::Kind::damaged,
          {fmt::format("{} at byte {}", file_.path().string(), offset), std::string(what),
           "the file is damaged; hapticctl trace recover saves the intact parts to a new file"}};
}

Fault Scanner::foreign(std::string_view what, std::string_view remedy) const {
  return {Fault::Kind::foreign, {file_.path().string(), std::string(what), std::string(remedy)}};
}

std::expected<RecordHead, Fault> Scanner::head() const {
  const auto bytes = peek(kRecordHeadBytes);
  if (!bytes) return std::unexpected(bytes.error());
  if (bytes->size() < kRecordHeadBytes) return std::unexpected(cut(file_.path(), offset_));
  ByteReader reader(*bytes);
  RecordHead head{.opcode = static_cast<Opcode>(reader.number<std::uint8_t>()), .offset = offset_};
  head.length = reader.number<std::uint64_t>();
  if (head.length > size_ - offset_ - kRecordHeadBytes) return std::unexpected(cut(file_.path(), offset_));
  if (head.length > kMaxRecordBytes) {
    return std::unexpected(damaged(
        offset_, fmt::format("a record of {} bytes; at most {} are accepted", head.length, kMaxRecordBytes)));
  }
  return head;
}

std::expected<Record, Fault> Scanner::next() {
  const auto head = this->head();
  if (!head) return std::unexpected(head.error());
  std::string& bytes = content_;
  if (auto there = read(offset_, kRecordHeadBytes + head->length, bytes); !there) {
    return std::unexpected(there.error());
  }
  if (bytes.size() < kRecordHeadBytes + head->length) return std::unexpected(cut(file_.path(), offset_));
  const Record record{.opcode = head->opcode,
                      .offset = offset_,
                      .content = std::string_view(bytes).substr(kRecordHeadBytes),
                      .crc = crc_};
  skip(bytes);
  return record;
}

std::expected<bool, Fault> Scanner::atClosingMagic() {
  const auto rest = peek(kMagic.size() + 1);
  if (!rest) return std::unexpected(rest.error());
  if (*rest == kMagic) return true;
  if (kMagic.starts_with(*rest)) return std::unexpected(cut(file_.path(), offset_));
  return std::unexpected(damaged(offset_, "the end of the file has unexpected bytes"));
}

std::expected<void, Fault> Scanner::read(std::uint64_t offset, std::size_t length, std::string& to) const {
  if (auto read = file_.readAt(offset, length, to); !read) return unreadable(read.error());
  return {};
}

std::expected<std::string, Fault> Scanner::peek(std::size_t length) const {
  std::string bytes;
  if (auto there = read(offset_, length, bytes); !there) return std::unexpected(there.error());
  return bytes;
}

void Scanner::restart() {
  offset_ = 0;
  crc_ = 0;
  skip(kMagic);
}

void Scanner::skip(std::string_view bytes) {
  crc_ = crcOf(bytes, crc_);
  offset_ += bytes.size();
}

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
