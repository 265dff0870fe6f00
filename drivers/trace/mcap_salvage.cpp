// SPDX-License-Identifier: Apache-2.0
#include "drivers/trace/mcap_salvage.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "drivers/trace/mcap_definitions.h"
#include "drivers/trace/mcap_record_form.h"
#include "drivers/trace/mcap_record_places.h"

namespace hapticd::drivers::mcap {
namespace {

bool isOfSummaryOnly(Opcode opcode) {
  return opcode == Opcode::chunk_index || opcode == Opcode::attachment_index ||
         opcode == Opcode::metadata_index || opcode == Opcode::statistics || opcode == Opcode::summary_offset;
}

/// Other programs may omit checksums, and write records that hapticd does not.
bool isByHapticd(std::string_view header) {
  ByteReader reader(header);
  reader.text();  // skips the profile
  return reader.text() == "hapticd";
}

class Walk {
 public:
  Walk(const TraceFile& file, std::uint64_t size, const GoesOn& goes_on)
      : file_(file), bytes_(file, size), places_(bytes_), allowance_(size), goes_on_(goes_on) {}

  config::Result<Salvage> run() {
    found_.file_bytes = bytes_.size();
    at_ = kMagic.size();
    if (bytes_.at(0, kMagic.size()) != kMagic) {
      damaged(0, kMagic.size(), "the first bytes of the file are not those of MCAP");
    }
    while (at_ < bytes_.size() && !bytes_.failure()) {
      if (bytes_.isClosingMagic(at_)) {
        found_.ended = footer_seen_;
        break;
      }
      step();
      if (goes_on_ && !goes_on_(static_cast<double>(at_) / static_cast<double>(bytes_.size()))) {
        return std::unexpected(interrupted(file_.path()));
      }
    }
    if (bytes_.failure()) return std::unexpected(*bytes_.failure());
    finish();
    return std::move(found_);
  }

 private:
  void damaged(std::uint64_t offset, std::uint64_t length, std::string what, bool loses = true) {
    if (!found_.damages.empty()) {
      Damage& last = found_.damages.back();
      if (last.offset + last.bytes == offset && last.what == what && last.loses == loses) {
        last.bytes += length;
        return;
      }
    }
    found_.damages.push_back({offset, length, std::move(what), loses});
  }

  /// Indexes and the summary can be rebuilt, so that their damage loses nothing.
  bool loses(std::uint64_t from, std::uint64_t to) const {
    if (in_summary_ && !data_differ_) return false;
    if (found_.chunks.empty()) return true;
    const IntactChunk& chunk = found_.chunks.back();
    const std::uint64_t index_at = chunk.offset + chunk.bytes;
    return from < index_at || to > index_at + chunk.index_bytes;
  }

  void step() {
    const std::uint64_t begin = at_;
    const auto record = bytes_.head(begin);
    const std::string wrong = record ? take(*record) : beginning(begin);
    if (bytes_.failure()) return;
    if (wrong.empty()) {
      at_ = next_;
    } else {
      indexed_.reset();
      at_ = resume(begin, record);
      damaged(begin, at_ - begin, wrong, loses(begin, at_));
    }
  }

  /// Describes what is at an offset where no record can begin.
  std::string beginning(std::uint64_t offset) {
    const std::string begin = bytes_.at(offset, kRecordHeadBytes);
    const bool cut = begin.size() < kRecordHeadBytes || isKnown(static_cast<Opcode>(begin.front()));
    return cut ? "an incomplete record" : "bytes that are not a record of a trace";
  }

  /// Returns where to go on behind a damaged record.
  std::uint64_t resume(std::uint64_t begin, const std::optional<RecordPlace>& record) {
    const auto next = places_.next(begin);
    const bool length_is_right = record && (!next || record->end <= *next);
    if (length_is_right && bytes_.mayContinueAt(record->end)) return record->end;
    return next.value_or(bytes_.size());
  }

  // -- Records --

  /// Processes a record. Returns a description of its fault, or "".
  std::string take(const RecordPlace& head) {
    if (head.opcode != Opcode::message_index) indexed_.reset();
    next_ = head.end;
    const bool goes_on = bytes_.mayContinueAt(head.end);
    // There may be many records whose wrong length reaches to the end of the file: they are not read.
    const auto next = places_.next(head.begin);
    const bool is_wrong = (next && *next < head.end) || (!goes_on && !places_.mayBe(head));
    if (is_wrong) return malformedText(head.opcode);
    if (!isKnown(head.opcode)) return is_by_hapticd_ ? "a record of an unknown type" : "";
    if (isOfSummaryOnly(head.opcode) && !in_summary_) return "a record that belongs to the summary";
    std::string content = bytes_.content(head);
    if (head.opcode == Opcode::chunk) return chunk(head, content);
    if (head.opcode == Opcode::message) return message(head.begin, std::move(content));
    const bool has_checksum = head.opcode == Opcode::attachment;
    if (!hasForm(head.opcode, content) || !(has_checksum || goes_on)) return malformedText(head.opcode);
    switch (head.opcode) {
      case Opcode::header:
        if (head.begin != kMagic.size()) return "a misplaced header";
        is_by_hapticd_ = isByHapticd(content);
        return "";
      case Opcode::schema:
        // hapticd writes nothing after the last text, so the length of a text has changed.
        if (is_by_hapticd_ && !SchemaRecord::fills(content)) return malformedText(head.opcode);
        define(schemas_, "a schema", head.begin, std::move(content));
        return "";
      case Opcode::channel:
        define(channels_, "a channel", head.begin, std::move(content));
        return "";
      case Opcode::metadata:
        found_.metadata.push_back({head.begin, std::move(content)});
        return "";
      case Opcode::attachment:
        return attachment(head, content);
      case Opcode::message_index:
        return messageIndex(content);
      case Opcode::data_end:
        return dataEnd(head.begin, content);
      case Opcode::footer:
        return footer(head, content);
      case Opcode::chunk_index:
        chunk_indexes_.push_back(IndexedChunk::of(content));
        return "";
      case Opcode::statistics:
        messages_meant_ = ByteReader(content).number<std::uint64_t>();
        return "";
      default:
        return "";
    }
  }

  /// The definitions of the data and of the summary by id; equal ones count once.
  struct Definitions {
    std::map<std::uint16_t, IntactRecord> of_data, of_summary;
  };

  void define(Definitions& all, const char* what, std::uint64_t offset, std::string content) {
    const auto id = ByteReader(content).number<std::uint16_t>();
    auto& definitions = in_summary_ ? all.of_summary : all.of_data;
    const std::size_t length = kRecordHeadBytes + content.size();
    const auto [place, is_new] = definitions.try_emplace(id, IntactRecord{offset, std::move(content)});
    if (is_new || place->second.content == content) return;
    damaged(offset, length, differs(what, id));
  }
  static std::string differs(const char* what, std::uint16_t id) {
    return fmt::format("{} that differs from {} with the same number {}", what, what, id);
  }

  /// Of different definitions with the same id, takes that of the summary, which has a checksum.
  std::vector<IntactRecord> settled(Definitions& all, const char* what) {
    for (auto& [id, record] : all.of_summary) {
      const auto [place, is_new] = all.of_data.try_emplace(id, record);
      if (is_new || place->second.content == record.content) continue;
      const IntactRecord& wrong = summary_whole_ ? place->second : record;
      damaged(wrong.offset, kRecordHeadBytes + wrong.content.size(), differs(what, id), !summary_whole_);
      if (summary_whole_) place->second = std::move(record);
    }
    std::vector<IntactRecord> records;
    for (auto& [id, record] : all.of_data) records.push_back(std::move(record));
    return records;
  }

  /// Handles a record with a checksum that is longer than the bytes covered, because of fields of a later
  /// version or a wrong length that includes the following records. Returns the offset of its end.
  std::uint64_t endOfChecked(const RecordPlace& head, std::size_t covered) {
    const std::uint64_t end = head.begin + kRecordHeadBytes + covered;
    if (end >= head.end || bytes_.mayContinueAt(head.end)) return head.end;
    damaged(head.begin, kRecordHeadBytes, "the length of a record is wrong", false);
    next_ = end;
    return end;
  }

  std::string attachment(const RecordPlace& head, std::string_view content) {
    AttachmentRecord attachment;
    AttachmentRecord::of(content, attachment);
    const auto data_end = static_cast<std::size_t>(attachment.data.end() - content.begin());
    const std::size_t covered = data_end + sizeof(std::uint32_t);
    const bool has_checksum = ByteReader(content.substr(data_end)).number<std::uint32_t>() != 0;
    if (!has_checksum && (is_by_hapticd_ || covered < content.size()))
      return "an attachment without checksum";
    const std::uint64_t end = endOfChecked(head, covered);
    found_.attachments.push_back(
        {head.begin, std::string(content.substr(0, end - head.begin - kRecordHeadBytes))});
    return "";
  }

  std::string chunk(const RecordPlace& head, const std::string& content) {
    std::string unpacked;
    ChunkRecord chunk;
    ChunkContent inside;
    if (std::string wrong = unpackChunk(content, allowance_, unpacked, chunk, inside); !wrong.empty())
      return wrong;
    const auto covered = static_cast<std::size_t>(chunk.records.end() - std::string_view(content).begin());
    if (unpacked.empty() && covered == content.size()) return "";  // nothing is in it
    if (chunk.crc == 0 && (is_by_hapticd_ || covered < content.size())) return "a chunk without checksum";
    const std::uint64_t end = endOfChecked(head, covered);
    const auto key = std::tuple(crcOf(unpacked), unpacked.size(), inside.start_ns, inside.end_ns);
    if (!seen_.insert(key).second) {
      damaged(head.begin, end - head.begin, "a duplicate chunk", false);
      return "";
    }
    if (chunk.start_ns != inside.start_ns || chunk.end_ns != inside.end_ns) {
      damaged(head.begin, end - head.begin, "the times of a chunk do not match those of its messages", false);
    }
    for (const std::string_view schema : inside.schemas) {
      if (hasForm(Opcode::schema, schema)) define(schemas_, "a schema", head.begin, std::string(schema));
    }
    for (const std::string_view channel : inside.channels) {
      if (hasForm(Opcode::channel, channel)) define(channels_, "a channel", head.begin, std::string(channel));
    }
    for (const auto& [channel, places] : inside.messages) {
      found_.used_channels.insert(channel);
      found_.messages_whole += places.size();
    }
    const std::string index = inside.indexRecords();
    const bool indexed = bytes_.at(end, index.size()) == index;
    found_.chunks.push_back(
        {head.begin, end - head.begin, inside.start_ns, inside.end_ns, indexed, index.size()});
    if (indexed) {
      next_ = end + index.size();
    } else {
      indexed_ = std::move(inside.messages);
    }
    return "";
  }

  /// An index belongs to the chunk before it, from which it can be rebuilt.
  std::string messageIndex(std::string_view content) {
    MessageIndex index;
    MessageIndex::of(content, index);
    if (!indexed_ || index.places.empty()) return "";  // the chunk may be damaged itself
    const auto expected = indexed_->find(index.channel);
    bool fits = expected != indexed_->end();
    if (fits) {
      std::ranges::sort(expected->second);
      std::ranges::sort(index.places);
      fits = expected->second == index.places;
    }
    if (!fits) {
      damaged(at_, kRecordHeadBytes + content.size(), "the index of a chunk does not match it", false);
    }
    return "";
  }

  /// Messages outside of chunks have no checksum.
  std::string message(std::uint64_t offset, std::string content) {
    MessageRecord message;
    if (is_by_hapticd_) return "a message outside of a chunk";
    if (!MessageRecord::of(content, message)) return "an incomplete message";
    if (!channels_.of_data.contains(message.channel)) {
      return fmt::format("a message of channel {}, which is not defined", message.channel);
    }
    if (!found_.damages.empty() && !found_.chunks.empty())
      return "a message that may belong to a damaged chunk";
    found_.messages.push_back({offset, std::move(content)});
    return "";
  }

  // -- End of the file --

  std::string dataEnd(std::uint64_t offset, std::string_view content) {
    if (in_summary_) return "a misplaced DataEnd";
    const auto crc = ByteReader(content).number<std::uint32_t>();
    data_differ_ = crc != 0 && bytes_.crc(0, offset) != crc;
    data_end_ = offset;
    in_summary_ = true;
    return "";
  }

  std::string footer(const RecordPlace& head, std::string_view content) {
    if (footer_seen_) return "a misplaced footer";
    ByteReader reader(content);
    const auto summary_at = reader.number<std::uint64_t>();
    reader.number<std::uint64_t>();
    const auto crc = reader.number<std::uint32_t>();
    const std::uint64_t from = summary_at == 0 ? head.begin : summary_at;
    const bool fits = from <= head.begin && crc == bytes_.crc(from, head.end - sizeof crc);
    footer_seen_ = true;
    summary_whole_ = fits && in_summary_;
    if (crc != 0 && !fits) damaged(head.begin, 0, "the checksum of the summary does not match", false);
    return "";
  }

  void finish() {
    if (!found_.ended) damaged(bytes_.size(), 0, "the end of the file is missing", false);
    found_.schemas = settled(schemas_, "a schema");
    found_.channels = settled(channels_, "a channel");
    std::ranges::stable_sort(found_.damages, {}, &Damage::offset);
    if (summary_whole_) compareWithSummary();
    if (found_.ended && !summary_whole_ && !in_summary_)
      damaged(bytes_.size(), 0, "the DataEnd record is missing", false);
    if (data_differ_ && found_.damages.empty()) {
      damaged(0, data_end_,
              "the checksum of the data does not match, although all chunks and attachments do: the header, "
              "schemas, channels, metadata or indexes have changed");
    }
    findUndefined();
    found_.messages_whole += found_.messages.size();
    std::ranges::stable_sort(found_.damages, {}, &Damage::offset);
    findTimes();
  }

  void findUndefined() {
    for (const std::uint16_t id : found_.used_channels) {
      if (!channels_.of_data.contains(id))
        damaged(0, 0, fmt::format("the definition of channel {} is lost", id));
    }
    for (const IntactRecord& channel : found_.channels) {
      ChannelRecord record;
      ChannelRecord::of(channel.content, record);
      if (record.schema != 0 && !schemas_.of_data.contains(record.schema)) {
        damaged(0, 0, fmt::format("the definition of schema {} is lost", record.schema));
      }
    }
  }

  /// The damages are in file order.
  void compareWithSummary() {
    found_.messages_meant = messages_meant_;
    std::map<std::tuple<std::uint64_t, std::uint64_t, std::uint64_t>, const IntactChunk*> chunks;
    for (const IntactChunk& chunk : found_.chunks) {
      chunks.try_emplace({chunk.start_ns, chunk.end_ns, chunk.bytes}, &chunk);
    }
    std::vector<std::pair<std::uint64_t, std::uint64_t>> lost;  // begin and end of what is damaged
    for (const Damage& damage : found_.damages) {
      if (damage.loses) lost.emplace_back(damage.offset, damage.offset + damage.bytes);
    }
    for (const auto& [start_ns, end_ns, offset, bytes] : chunk_indexes_) {
      const auto found = chunks.find({start_ns, end_ns, bytes});
      if (found == chunks.end()) {
        const auto after = std::ranges::lower_bound(lost, std::pair(offset + bytes, std::uint64_t{0}));
        const bool known = after != lost.begin() && std::prev(after)->second > offset;
        if (!known) damaged(offset, 0, "a chunk is missing");
      } else if (found->second->offset != offset) {
        damaged(found->second->offset, found->second->bytes,
                "the position of a chunk does not match the summary", false);
      }
    }
  }

  /// The chunks and the damages are in file order.
  void findTimes() {
    constexpr std::uint64_t kNever = std::numeric_limits<std::uint64_t>::max();
    const std::vector<IntactChunk>& chunks = found_.chunks;
    std::vector<std::uint64_t> ends_ns{0}, starts_ns(chunks.size() + 1, kNever);
    for (const IntactChunk& chunk : chunks) ends_ns.push_back(std::max(ends_ns.back(), chunk.end_ns));
    for (std::size_t i = chunks.size(); i-- > 0;)
      starts_ns[i] = std::min(starts_ns[i + 1], chunks[i].start_ns);
    const auto firstFrom = [&chunks](std::uint64_t offset) {
      return static_cast<std::size_t>(std::ranges::lower_bound(chunks, offset, {}, &IntactChunk::offset) -
                                      chunks.begin());
    };
    for (Damage& damage : found_.damages) {
      damage.after_ns = ends_ns[firstFrom(damage.offset)];
      const std::uint64_t start_ns =
          starts_ns[firstFrom(damage.offset + std::max<std::uint64_t>(damage.bytes, 1))];
      damage.before_ns = start_ns == kNever ? 0 : start_ns;
    }
  }

  const TraceFile& file_;
  FileBytes bytes_;
  ChunkPlaces places_;
  Allowance allowance_;
  const GoesOn& goes_on_;
  Salvage found_;
  std::uint64_t at_ = 0;
  std::uint64_t next_ = 0;      ///< offset of the next record if the one at `at_` is intact
  bool is_by_hapticd_ = false;  ///< a missing checksum then means damage
  Definitions schemas_, channels_;
  /// Messages of the chunk that indexes may follow.
  std::optional<std::map<std::uint16_t, std::vector<MessagePlace>>> indexed_;
  std::set<std::tuple<std::uint32_t, std::size_t, std::uint64_t, std::uint64_t>> seen_;  ///< chunks found
  // state of the end of the file
  bool in_summary_ = false;
  bool footer_seen_ = false;
  bool summary_whole_ = false;
  bool data_differ_ = false;
  std::uint64_t data_end_ = 0;
  std::vector<IndexedChunk> chunk_indexes_;
  std::optional<std::uint64_t> messages_meant_;
};

}  // namespace

config::Error interrupted(const std::filesystem::path& file) {
  return {file.string(), "was not finished, because the program ends", "it is tried again"};
}

config::Result<Salvage> salvage(const TraceFile& file, std::uint64_t size, const GoesOn& goes_on) {
  return Walk(file, size, goes_on).run();
}

}  // namespace hapticd::drivers::mcap
