#include "drivers/trace/mcap_reader.h"

#include <fmt/format.h>

#include <map>
#include <optional>

namespace hapticd::drivers::mcap {
namespace {

constexpr const char* kNotWhole = "a record that is not whole";

struct Schema {
  std::string name;
  std::string encoding;
  std::string text;
};

/// One pass over a file. What is wrong with a record or a part of it is a text, "" if nothing is.
class Reading {
 public:
  Reading(Scanner scanner, Visitor& visitor) : scanner_(std::move(scanner)), visitor_(visitor) {}

  std::expected<void, Fault> run() {
    while (!visitor_.enough()) {
      const auto record = scanner_.next();
      if (!record) return std::unexpected(record.error());
      if (const std::string wrong = take(*record); !wrong.empty()) {
        return std::unexpected(scanner_.damaged(record->offset, wrong));
      }
      if (const auto refusal = visitor_.refusal()) {
        return std::unexpected(scanner_.foreign(refusal->what, refusal->remedy));
      }
      if (record->opcode != Opcode::footer) continue;
      if (const auto end = scanner_.atClosingMagic(); !end) return std::unexpected(end.error());
      return {};
    }
    return {};
  }

 private:
  std::string take(const Record& record) {
    const bool first = record.offset == kMagic.size();
    if (first != (record.opcode == Opcode::header)) return "the header is not where it should be";
    if (summary_at_) return record.opcode == Opcode::footer ? footer(record) : "";
    switch (record.opcode) {
      case Opcode::schema:
        return schema(record.content);
      case Opcode::channel:
        return channel(record.content);
      case Opcode::chunk:
        return chunk(record);
      case Opcode::attachment:
        return attachment(record.content);
      case Opcode::metadata:
        return metadata(record.content);
      case Opcode::data_end:
        return dataEnd(record);
      case Opcode::message:
        return "a message outside of chunks, which a trace does not have";
      case Opcode::footer:
        return "the end of the data is missing";
      default:
        return "";  // indexes, which are for whoever reads in another order, and what later versions add
    }
  }

  std::string schema(std::string_view content) {
    ByteReader reader(content);
    const auto id = reader.number<std::uint16_t>();
    Schema schema;
    schema.name = reader.text();
    schema.encoding = reader.text();
    schema.text = reader.text();
    if (!reader.good()) return kNotWhole;
    schemas_[id] = std::move(schema);
    return "";
  }

  std::string channel(std::string_view content) {
    ByteReader reader(content);
    Channel channel;
    channel.id = reader.number<std::uint16_t>();
    const Schema& schema = schemas_[reader.number<std::uint16_t>()];
    channel.topic = reader.text();
    channel.encoding = reader.text();
    channel.schema_name = schema.name;
    channel.schema_encoding = schema.encoding;
    channel.schema = schema.text;
    if (!reader.good()) return kNotWhole;
    visitor_.channel(channel);
    return "";
  }

  std::string chunk(const Record& record) {
    ChunkRecord chunk;
    if (!ChunkRecord::of(record.content, chunk)) return kNotWhole;
    std::string_view records;
    if (std::string wrong = chunk.unpack(buffer_, records); !wrong.empty()) return wrong;
    visitor_.chunk(record.offset, scanner_.size());
    for (ByteReader reader(records); !reader.atEnd() && !visitor_.enough();) {
      const auto opcode = static_cast<Opcode>(reader.number<std::uint8_t>());
      const std::string_view content = reader.sized<std::uint64_t>();
      if (!reader.good()) return kNotWhole;
      if (std::string wrong = takeOfChunk(opcode, content); !wrong.empty()) return wrong;
    }
    return "";
  }

  std::string takeOfChunk(Opcode opcode, std::string_view content) {
    if (opcode != Opcode::message) return "something else than messages in a chunk";
    ByteReader reader(content);
    Message message;
    message.channel = reader.number<std::uint16_t>();
    reader.number<std::uint32_t>();  // sequence
    message.time_ns = reader.number<std::uint64_t>();
    reader.number<std::uint64_t>();  // publish time
    message.data = reader.raw(reader.left());
    return reader.good() ? visitor_.message(message) : kNotWhole;
  }

  std::string attachment(std::string_view content) {
    AttachmentRecord attachment;
    std::string wrong = AttachmentRecord::of(content, attachment);
    if (wrong.empty()) visitor_.attachment(attachment);
    return wrong;
  }

  std::string metadata(std::string_view content) {
    ByteReader reader(content);
    const std::string_view name = reader.text();
    ByteReader map(reader.text());
    Pairs pairs;
    while (!map.atEnd()) {
      std::string key(map.text());
      pairs.emplace_back(std::move(key), map.text());
    }
    if (!reader.good() || !map.good()) return kNotWhole;
    visitor_.metadata(name, std::move(pairs));
    return "";
  }

  std::string dataEnd(const Record& record) {
    ByteReader reader(record.content);
    const auto crc = reader.number<std::uint32_t>();
    if (!reader.good()) return kNotWhole;
    if (crc != record.crc) return "the checksum of the data does not fit";
    summary_at_ = scanner_.offset();
    scanner_.restartCrc();
    return "";
  }

  std::string footer(const Record& record) {
    if (record.content.size() != kFooterBytes) return kNotWhole;
    ByteReader reader(record.content);
    const auto summary_at = reader.number<std::uint64_t>();
    reader.number<std::uint64_t>();  // of the summary's offsets
    const auto crc = reader.number<std::uint32_t>();
    std::string head;
    addRecord(head, Opcode::footer, [&] { head += record.content; });
    const std::string_view covered = std::string_view(head).substr(0, head.size() - sizeof crc);
    if (summary_at != summary_at_) return "the summary is not where it should be";
    if (crc != crcOf(covered, record.crc)) return "the checksum of the summary does not fit";
    return "";
  }

  Scanner scanner_;
  Visitor& visitor_;
  std::map<std::uint16_t, Schema> schemas_;
  std::string buffer_;  ///< of an uncompressed chunk
  std::optional<std::uint64_t> summary_at_;
};

}  // namespace

std::expected<void, Fault> read(const std::filesystem::path& file, Visitor& visitor) {
  auto scanner = Scanner::open(file);
  if (!scanner) return std::unexpected(scanner.error());
  return Reading(std::move(*scanner), visitor).run();
}

}  // namespace hapticd::drivers::mcap
