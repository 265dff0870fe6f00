// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/mcap/mcap_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <utility>

namespace hapticd::trace::mcap {
namespace {

/// Messages outside of chunks are grouped into parts of this size.
constexpr std::uint64_t kMaxLooseBytes = 1 << 20;

class Surveying {
 public:
  Surveying(Scanner& scanner, SurveyVisitor& visitor) : scanner_(scanner), visitor_(visitor) {}

  Survey run() {
    while (true) {
      const auto head = scanner_.head();
      if (!head) return ended(head.error());
      if (head->opcode == Opcode::data_end || head->opcode == Opcode::footer) return std::move(found_);
      if (const auto taken = take(*head); !taken) return ended(taken.error());
      scanner_.jump(head->end());
    }
  }

 private:
  Survey ended(const Fault& fault) {
    found_.fault = fault;
    return std::move(found_);
  }

  std::expected<void, Fault> take(const RecordHead& head) {
    switch (head.opcode) {
      case Opcode::chunk:
        return chunk(head);
      case Opcode::message:
        return message(head);
      case Opcode::schema:
      case Opcode::channel:
      case Opcode::metadata:
      case Opcode::attachment:
        return whole(head);
      default:
        return {};
    }
  }

  std::expected<void, Fault> whole(const RecordHead& head) {
    const auto record = scanner_.next();
    if (!record) return std::unexpected(record.error());
    const bool defines = head.opcode == Opcode::schema || head.opcode == Opcode::channel;
    const std::string wrong = defines ? visitor_.definition(*record) : visitor_.companion(*record);
    if (!wrong.empty()) return std::unexpected(scanner_.damaged(head.offset, wrong));
    return {};
  }

  /// Reads the time at offset `at` of the record's content.
  std::expected<std::uint64_t, Fault> time(const RecordHead& head, std::size_t at) {
    std::string bytes;
    if (auto read = scanner_.read(head.offset + kRecordHeadBytes + at, sizeof(std::uint64_t), bytes); !read) {
      return std::unexpected(read.error());
    }
    return ByteReader(bytes).number<std::uint64_t>();
  }

  std::expected<void, Fault> chunk(const RecordHead& head) {
    const auto start_ns = time(head, 0), end_ns = time(head, sizeof(std::uint64_t));
    if (!start_ns || !end_ns) return std::unexpected(start_ns ? end_ns.error() : start_ns.error());
    const bool empty = *start_ns == 0 && *end_ns == 0;  // an empty chunk may have any time
    const std::uint64_t before_ns = found_.stretches.empty() ? 0 : found_.stretches.back().start_ns;
    found_.stretches.push_back({head.offset, head.end() - head.offset, empty ? before_ns : *start_ns, true});
    return {};
  }

  std::expected<void, Fault> message(const RecordHead& head) {
    constexpr std::size_t kTimeAt = sizeof(std::uint16_t) + sizeof(std::uint32_t);  // channel, sequence
    const auto time_ns = time(head, kTimeAt);
    if (!time_ns) return std::unexpected(time_ns.error());
    const std::uint64_t bytes = head.end() - head.offset;
    Stretch* const last = found_.stretches.empty() ? nullptr : &found_.stretches.back();
    if (last != nullptr && !last->chunk && last->end() == head.offset && last->bytes < kMaxLooseBytes) {
      last->bytes += bytes;
      last->start_ns = std::min(last->start_ns, *time_ns);
    } else {
      found_.stretches.push_back({head.offset, bytes, *time_ns, false});
    }
    return {};
  }

  Scanner& scanner_;
  SurveyVisitor& visitor_;
  Survey found_;
};

}  // namespace

bool Survey::inOrderOfTime() const {
  return std::ranges::is_sorted(stretches, {}, &Stretch::start_ns);
}

Survey survey(Scanner& scanner, SurveyVisitor& visitor) {
  return Surveying(scanner, visitor).run();
}

bool Merger::isLater(const Stretch& a, const Stretch& b) {
  const auto key = [](const Stretch& stretch) {
    return std::pair(stretch.messages[stretch.next].first, stretch.offset);
  };
  return key(a) > key(b);
}

void Merger::add(std::uint64_t offset, std::string records) {
  Stretch stretch{.offset = offset,
                  .records = std::make_unique<const std::string>(std::move(records)),
                  .messages = {},
                  .next = 0};
  visitRecords(*stretch.records, [&](Opcode opcode, std::string_view content, std::uint64_t at) {
    MessageRecord message;
    if (opcode == Opcode::message && MessageRecord::of(content, message)) {
      stretch.messages.emplace_back(message.time_ns, at);
    }
    return true;
  });
  if (stretch.messages.empty()) return;
  stretch.messages.shrink_to_fit();
  std::ranges::sort(stretch.messages);  // of equal times the earlier in the file comes first
  bytes_ += stretch.records->size();
  stretches_.push_back(std::move(stretch));
  std::ranges::push_heap(stretches_, isLater);
}

bool Merger::next(std::uint64_t until_ns, MessageRecord& message) {
  if (stretches_.empty()) return false;
  const Stretch& earliest = stretches_.front();
  const auto [time_ns, at] = earliest.messages[earliest.next];
  if (time_ns > until_ns) return false;
  ByteReader record(std::string_view(*earliest.records).substr(at + 1));  // after the opcode
  MessageRecord::of(record.sized<std::uint64_t>(), message);
  std::ranges::pop_heap(stretches_, isLater);
  Stretch& taken = stretches_.back();
  if (++taken.next < taken.messages.size()) {
    std::ranges::push_heap(stretches_, isLater);
  } else {
    bytes_ -= taken.records->size();
    last_ = std::move(taken.records);
    stretches_.pop_back();
  }
  return true;
}

namespace {

constexpr const char* kNotWhole = "an incomplete record";

/// Reads one file. Faults of a record or a part of it are returned as a text, or "" if there is none.
class Reading final : SurveyVisitor {
 public:
  Reading(Scanner scanner, Visitor& visitor)
      : scanner_(std::move(scanner)), visitor_(visitor), allowance_(scanner_.size()) {}

  std::expected<void, Fault> run() {
    survey_ = survey(scanner_, *this);
    visitor_.messages();
    if (const auto refused = refusal()) {
      // Required data may be in the unreadable part.
      return std::unexpected(survey_.fault ? *survey_.fault : *refused);
    }
    scanner_.restart();
    const bool in_order = survey_.inOrderOfTime();
    gives_ = in_order;
    const auto checked = records();
    if (!in_order) {
      if (const auto given = inOrderOfTime(); !given) return given;
    }
    return checked;
  }

 private:
  // -- Definitions, metadata and attachments outside of chunks, which come before the messages --

  std::string definition(const Record& record) override { return define(record.opcode, record.content); }

  std::string companion(const Record& record) override {
    return record.opcode == Opcode::metadata ? metadata(record.content) : attachment(record.content);
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

  // -- One pass in the order of the file --

  /// Checks all records and their checksums; also delivers the messages if the file is in time order.
  std::expected<void, Fault> records() {
    while (!visitor_.enough()) {
      const auto record = scanner_.next();
      if (!record) return ended(record.error());
      if (const std::string wrong = take(*record); !wrong.empty()) {
        return ended(scanner_.damaged(record->offset, wrong));
      }
      intact_to_ = scanner_.offset();
      if (const auto refused = refusal()) return std::unexpected(*refused);
      if (record->opcode != Opcode::footer) continue;
      if (const auto end = scanner_.atClosingMagic(); !end) return std::unexpected(end.error());
      return {};
    }
    return {};
  }

  /// Delivers what is intact before reporting the fault.
  std::expected<void, Fault> ended(const Fault& fault) {
    merger_.add(intact_to_, std::exchange(loose_, {}));
    if (const std::string wrong = give(std::numeric_limits<std::uint64_t>::max()); !wrong.empty()) {
      return std::unexpected(scanner_.damaged(scanner_.offset(), wrong));
    }
    return std::unexpected(fault);
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
    if (std::string wrong = unpack(record.content, records); !wrong.empty()) return wrong;
    visitor_.chunk(record.offset, scanner_.size());
    return gives_ ? giveAfter(record.offset, std::move(records)) : "";
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
    if (std::string wrong = checkMessage(record.content, 0, kAnyTime); !wrong.empty() || !gives_)
      return wrong;
    if (next_stretch_ >= survey_.stretches.size()) return "the file was modified while it was read";
    addRecord(loose_, Opcode::message, [&] { loose_ += record.content; });
    const Stretch& stretch = survey_.stretches[next_stretch_];
    if (scanner_.offset() < stretch.end()) return "";
    return giveAfter(stretch.offset, std::exchange(loose_, {}));
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

  // -- Messages --

  /// Adds the records of the next part and delivers all messages that nothing can precede any more.
  std::string giveAfter(std::uint64_t offset, std::string records) {
    merger_.add(offset, std::move(records));
    ++next_stretch_;
    const bool last = next_stretch_ >= survey_.stretches.size();
    std::string wrong =
        give(last ? std::numeric_limits<std::uint64_t>::max() : survey_.stretches[next_stretch_].start_ns);
    const std::uint64_t most_bytes = mostHeld(scanner_.size(), kMaxOverlapBytes);
    if (wrong.empty() && merger_.bytes() > most_bytes) {
      return fmt::format("more than {} MB of messages overlap in time; sort the file, e.g. with mcap sort",
                         most_bytes >> 20);
    }
    return wrong;
  }

  std::string give(std::uint64_t until_ns) {
    MessageRecord message;
    while (!visitor_.enough() && merger_.next(until_ns, message)) {
      std::string wrong =
          visitor_.message({message.channel, message.time_ns, message.publish_time_ns, message.data});
      if (!wrong.empty()) return wrong;
    }
    return "";
  }

  /// Reads the parts that records() has found intact in the order of their times.
  std::expected<void, Fault> inOrderOfTime() {
    std::erase_if(survey_.stretches, [this](const Stretch& stretch) { return stretch.end() > intact_to_; });
    std::ranges::stable_sort(survey_.stretches, {}, &Stretch::start_ns);
    next_stretch_ = 0;
    allowance_ = Allowance(scanner_.size());
    while (next_stretch_ < survey_.stretches.size() && !visitor_.enough()) {
      const Stretch stretch = survey_.stretches[next_stretch_];
      std::string bytes, records;
      if (auto read = scanner_.read(stretch.offset, stretch.bytes, bytes); !read) return read;
      std::string wrong =
          stretch.chunk ? unpack(std::string_view(bytes).substr(kRecordHeadBytes), records) : "";
      if (wrong.empty()) wrong = giveAfter(stretch.offset, stretch.chunk ? std::move(records) : bytes);
      if (!wrong.empty()) return std::unexpected(scanner_.damaged(stretch.offset, wrong));
      if (const auto refused = refusal()) return std::unexpected(*refused);
    }
    return {};
  }

  Scanner scanner_;
  Visitor& visitor_;
  Allowance allowance_;  ///< of this pass
  Survey survey_;
  Definitions definitions_;
  Merger merger_;
  std::uint64_t intact_to_ = 0;   ///< end of the verified part of the file
  std::size_t next_stretch_ = 0;  ///< next part of the survey
  bool gives_ = false;            ///< the pass in the order of the file delivers the messages
  std::string loose_;             ///< messages outside of chunks of the next part
  std::optional<std::uint64_t> summary_at_;
};

}  // namespace

std::expected<void, Fault> read(const std::filesystem::path& file, Visitor& visitor) {
  auto scanner = Scanner::open(file);
  if (!scanner) return std::unexpected(scanner.error());
  return Reading(std::move(*scanner), visitor).run();
}

}  // namespace hapticd::trace::mcap
