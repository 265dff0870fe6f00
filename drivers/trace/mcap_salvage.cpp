// SPDX-License-Identifier: Apache-2.0
#include "drivers/trace/mcap_salvage.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "drivers/trace/mcap_definitions.h"
#include "drivers/trace/mcap_record_form.h"

namespace hapticd::drivers::mcap {
namespace {

constexpr std::uint64_t kWindowBytes = 1 << 20;

bool isKnown(Opcode opcode) {
  return opcode >= Opcode::header && opcode <= Opcode::data_end;
}

/// The part of a ChunkIndex record that identifies its chunk.
struct IndexedChunk {
  std::uint64_t start_ns = 0, end_ns = 0, offset = 0, bytes = 0;

  static IndexedChunk of(std::string_view content) {
    ByteReader reader(content);
    IndexedChunk chunk;
    chunk.start_ns = reader.number<std::uint64_t>();
    chunk.end_ns = reader.number<std::uint64_t>();
    chunk.offset = reader.number<std::uint64_t>();
    chunk.bytes = reader.number<std::uint64_t>();
    return chunk;
  }
};

/// Other programs may omit checksums.
bool isByHapticd(std::string_view header) {
  ByteReader reader(header);
  reader.text();  // skips the profile
  return reader.text() == "hapticd";
}

class Search {
 public:
  Search(const TraceFile& file, std::uint64_t size, const std::function<void(double)>& progress)
      : file_(file), size_(size), progress_(progress) {}

  config::Result<Salvage> run() {
    at_ = kMagic.size();
    if (bytes(0, kMagic.size()) != kMagic) {
      damaged(0, kMagic.size(), "the first bytes of the file are not those of MCAP");
    }
    while (at_ < size_ && !failure_) {
      if (at_ + kMagic.size() == size_ && bytes(at_, kMagic.size()) == kMagic) {
        found_.ended = footer_seen_;
        break;
      }
      step();
    }
    if (failure_) return std::unexpected(*failure_);
    finish();
    return std::move(found_);
  }

 private:
  // -- Bytes --

  std::string bytes(std::uint64_t offset, std::uint64_t length) {
    std::string to;
    if (auto read = file_.readAt(offset, std::min(length, size_ - std::min(size_, offset)), to); !read) {
      failure_ = read.error();
      to.clear();
    }
    return to;
  }

  struct Head {
    Opcode opcode{};
    std::uint64_t end = 0;  ///< end of the record in the file
  };

  /// Returns nothing if no known record can begin with these bytes at this offset.
  std::optional<Head> headOf(std::string_view begin, std::uint64_t offset) const {
    if (begin.size() < kRecordHeadBytes) return {};
    ByteReader reader(begin);
    const auto opcode = static_cast<Opcode>(reader.number<std::uint8_t>());
    const auto length = reader.number<std::uint64_t>();
    const std::uint64_t room = size_ - offset - kRecordHeadBytes;
    if (!isKnown(opcode) || length > room || length > kMaxRecordBytes) return {};
    return Head{opcode, offset + kRecordHeadBytes + length};
  }
  std::optional<Head> head(std::uint64_t offset) { return headOf(bytes(offset, kRecordHeadBytes), offset); }
  std::string content(std::uint64_t offset, const Head& head) {
    return bytes(offset + kRecordHeadBytes, head.end - offset - kRecordHeadBytes);
  }

  bool isClosingMagic(std::uint64_t offset) {
    return offset + kMagic.size() == size_ && bytes(offset, kMagic.size()) == kMagic;
  }

  // -- Resynchronisation --

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
    const auto record = head(begin);
    const std::string wrong = record ? take(begin, *record) : beginning(begin);
    if (failure_) return;
    if (wrong.empty()) {
      at_ = next_;
    } else {
      indexed_.reset();
      at_ = resume(begin, record);
      damaged(begin, at_ - begin, wrong, loses(begin, at_));
      trusted_ = false;
    }
    if (progress_) progress_(static_cast<double>(at_) / static_cast<double>(size_));
  }

  /// Describes what is at an offset where no record can begin.
  std::string beginning(std::uint64_t offset) {
    if (size_ - offset < kRecordHeadBytes) return "an incomplete record";
    const auto opcode = static_cast<Opcode>(bytes(offset, 1).front());
    return isKnown(opcode) ? "an incomplete record" : "bytes that are not a record of a trace";
  }

  /// Returns the offset of the next intact record.
  std::uint64_t resume(std::uint64_t begin, const std::optional<Head>& record) {
    if (record && (record->end == size_ || isClosingMagic(record->end) || looksIntact(record->end) ||
                   (record->opcode == Opcode::message && isMessage(record->end)))) {
      return record->end;
    }
    std::string window;
    for (std::uint64_t from = begin + 1; from < size_ && !failure_; from += kWindowBytes) {
      window = bytes(from, kWindowBytes + kRecordHeadBytes);
      const std::uint64_t places = std::min<std::uint64_t>(kWindowBytes, window.size());
      for (std::uint64_t i = 0; i < places; ++i) {
        if (!isKnown(static_cast<Opcode>(window[i]))) continue;
        if (headOf(std::string_view(window).substr(i), from + i) && looksIntact(from + i)) return from + i;
      }
    }
    return size_;
  }

  bool isMessage(std::uint64_t offset) {
    const auto next = head(offset);
    return next && next->opcode == Opcode::message;
  }

  /// Returns whether a record may begin at this offset or the file ends there. A record without a checksum
  /// that is not followed by another one has a wrong length and may include intact records.
  bool mayContinueAt(std::uint64_t offset) {
    // Of any file, which may be truncated there.
    constexpr std::uint64_t kMaxLength = std::uint64_t{1} << 40;
    if (offset >= size_ || isClosingMagic(offset)) return true;
    const std::string begin = bytes(offset, kRecordHeadBytes);
    ByteReader reader(begin);
    if (!isKnown(static_cast<Opcode>(reader.number<std::uint8_t>()))) return false;
    const auto length = reader.number<std::uint64_t>();
    return !reader.good() || length < kMaxLength;
  }

  /// Returns whether a record is intact, by its checksum or by its form and what follows it. Messages have
  /// neither: in a damaged uncompressed chunk they look like records of the file.
  bool looksIntact(std::uint64_t offset) {
    const auto record = head(offset);
    if (!record || record->opcode == Opcode::header || record->opcode == Opcode::message) return false;
    if (record->opcode == Opcode::chunk) {
      std::string unpacked;
      const std::string all = content(offset, *record);
      return unpackChunk(all, unpacked).empty();
    }
    if (!hasForm(record->opcode, content(offset, *record))) return false;
    return record->opcode == Opcode::attachment || isClosingMagic(record->end) || head(record->end);
  }

  // -- Records --

  /// Processes a record. Returns a description of its fault, or "".
  std::string take(std::uint64_t offset, const Head& head) {
    if (head.opcode != Opcode::message_index) indexed_.reset();
    next_ = head.end;
    std::string content = this->content(offset, head);
    if (head.opcode == Opcode::chunk) return chunk(offset, head, content);
    if (head.opcode == Opcode::message) return message(offset, std::move(content));
    const bool has_checksum = head.opcode == Opcode::attachment;
    if (!hasForm(head.opcode, content) || !(has_checksum || mayContinueAt(head.end)))
      return malformedText(head.opcode);
    switch (head.opcode) {
      case Opcode::header:
        if (offset != kMagic.size()) return "a misplaced header";
        has_all_checksums_ = isByHapticd(content);
        return "";
      case Opcode::schema:
        // hapticd writes nothing after the last text, so the length of a text has changed.
        if (has_all_checksums_ && !SchemaRecord::fills(content)) return malformedText(head.opcode);
        keep(found_.schemas, offset, std::move(content));
        return "";
      case Opcode::channel:
        keep(found_.channels, offset, std::move(content));
        return "";
      case Opcode::metadata:
        keep(found_.metadata, offset, std::move(content));
        return "";
      case Opcode::attachment:
        return attachment(offset, head, content);
      case Opcode::message_index:
        return messageIndex(content);
      case Opcode::data_end:
        dataEnd(offset, content);
        return "";
      case Opcode::footer:
        footer(offset, content);
        return "";
      case Opcode::chunk_index:
        if (in_summary_) chunk_indexes_.push_back(IndexedChunk::of(content));
        return "";
      case Opcode::statistics:
        if (in_summary_) messages_meant_ = ByteReader(content).number<std::uint64_t>();
        return "";
      default:
        return "";
    }
  }

  /// Handles a record with a checksum that is longer than the bytes covered, because of fields of a later
  /// version or a wrong length that includes the following records. Returns the offset of its end.
  std::uint64_t endOfChecked(std::uint64_t offset, const Head& head, std::size_t covered) {
    const std::uint64_t end = offset + kRecordHeadBytes + covered;
    if (end >= head.end || mayContinueAt(head.end)) return head.end;
    damaged(offset, kRecordHeadBytes, "the length of a record is wrong", false);
    next_ = end;
    return end;
  }

  std::string attachment(std::uint64_t offset, const Head& head, std::string_view content) {
    AttachmentRecord attachment;
    AttachmentRecord::of(content, attachment);
    const auto data_end = static_cast<std::size_t>(attachment.data.end() - content.begin());
    const std::size_t covered = data_end + sizeof(std::uint32_t);
    const bool has_checksum = ByteReader(content.substr(data_end)).number<std::uint32_t>() != 0;
    if (!has_checksum && (has_all_checksums_ || covered < content.size()))
      return "an attachment without checksum";
    const std::uint64_t end = endOfChecked(offset, head, covered);
    keep(found_.attachments, offset, std::string(content.substr(0, end - offset - kRecordHeadBytes)));
    return "";
  }

  static void keep(std::vector<IntactRecord>& all, std::uint64_t offset, std::string content) {
    if (std::ranges::find(all, content, &IntactRecord::content) != all.end()) return;
    all.push_back({offset, std::move(content)});
  }

  std::string chunk(std::uint64_t offset, const Head& head, const std::string& content) {
    std::string unpacked;
    if (std::string wrong = unpackChunk(content, unpacked); !wrong.empty()) return wrong;
    ChunkRecord chunk;
    ChunkContent inside;
    ChunkRecord::of(content, chunk);
    ChunkContent::of(unpacked, inside);
    const auto covered = static_cast<std::size_t>(chunk.records.end() - std::string_view(content).begin());
    if (unpacked.empty() && covered == content.size()) return "";  // nothing is in it
    if (chunk.crc == 0 && (has_all_checksums_ || covered < content.size())) return "a chunk without checksum";
    const std::uint64_t end = endOfChecked(offset, head, covered);
    const auto key = std::tuple(crcOf(unpacked), unpacked.size(), inside.start_ns, inside.end_ns);
    if (!seen_.insert(key).second) {
      damaged(offset, end - offset, "a duplicate chunk", false);
      return "";
    }
    if (chunk.start_ns != inside.start_ns || chunk.end_ns != inside.end_ns) {
      damaged(offset, end - offset, "the times of a chunk do not match those of its messages", false);
    }
    for (const std::string_view schema : inside.schemas) {
      if (hasForm(Opcode::schema, schema)) keep(found_.schemas, offset, std::string(schema));
    }
    for (const std::string_view channel : inside.channels) {
      if (hasForm(Opcode::channel, channel)) keep(found_.channels, offset, std::string(channel));
    }
    for (const auto& [channel, places] : inside.messages) {
      found_.used_channels.insert(channel);
      found_.messages_whole += places.size();
    }
    const std::string index = inside.indexRecords();
    const bool indexed = bytes(end, index.size()) == index;
    found_.chunks.push_back({offset, end - offset, inside.start_ns, inside.end_ns, indexed, index.size()});
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
    if (!indexed_) return "";  // of a chunk that is damaged itself
    const auto expected = indexed_->find(index.channel);
    const bool fits =
        expected != indexed_->end() && std::ranges::is_permutation(expected->second, index.places);
    if (!fits && !index.places.empty()) {
      damaged(at_, kRecordHeadBytes + content.size(), "the index of a chunk does not match it", false);
    }
    return "";
  }

  /// Messages outside of chunks have no checksum.
  std::string message(std::uint64_t offset, std::string content) {
    MessageRecord message;
    if (!MessageRecord::of(content, message)) return "an incomplete message";
    const bool defined = std::ranges::any_of(found_.channels, [&](const IntactRecord& channel) {
      return ByteReader(channel.content).number<std::uint16_t>() == message.channel;
    });
    if (!defined) return fmt::format("a message of channel {}, which is not defined", message.channel);
    if (!trusted_ && !found_.chunks.empty()) return "a message that may belong to a damaged chunk";
    found_.messages.push_back({offset, std::move(content)});
    return "";
  }

  // -- End of the file --

  std::uint32_t crcOfFile(std::uint64_t from, std::uint64_t to) {
    std::uint32_t crc = 0;
    for (; from < to && !failure_; from += kWindowBytes) {
      crc = crcOf(bytes(from, std::min(kWindowBytes, to - from)), crc);
    }
    return crc;
  }

  void dataEnd(std::uint64_t offset, std::string_view content) {
    const auto crc = ByteReader(content).number<std::uint32_t>();
    data_differ_ = crc != 0 && crcOfFile(0, offset) != crc;
    data_end_ = offset;
    in_summary_ = true;
    chunk_indexes_.clear();
  }

  void footer(std::uint64_t offset, std::string_view content) {
    ByteReader reader(content);
    const auto summary_at = reader.number<std::uint64_t>();
    const std::uint64_t covered_to = offset + kRecordHeadBytes + kFooterBytes - sizeof(std::uint32_t);
    reader.number<std::uint64_t>();
    const auto crc = reader.number<std::uint32_t>();
    const std::uint64_t from = summary_at == 0 ? offset : summary_at;
    const bool fits = from <= offset && crc == crcOfFile(from, covered_to);
    footer_seen_ = true;
    summary_whole_ = fits && in_summary_;
    if (crc != 0 && !fits) damaged(offset, 0, "the checksum of the summary does not match", false);
  }

  void finish() {
    if (!found_.ended) damaged(size_, 0, "the end of the file is missing", false);
    settle(found_.schemas, "a schema");
    settle(found_.channels, "a channel");
    if (summary_whole_) compareWithSummary();
    if (found_.ended && !summary_whole_ && !in_summary_)
      damaged(size_, 0, "the DataEnd record is missing", false);
    if (data_differ_ && found_.damages.empty()) {
      damaged(0, data_end_,
              "the checksum of the data does not match, although all chunks and attachments do: the header, "
              "schemas, channels, metadata or indexes have changed",
              true);
    }
    if (!found_.chunks.empty() && !found_.messages.empty() && !trusted_) dropMessages();
    findUndefined();
    found_.messages_whole += found_.messages.size();
    std::ranges::stable_sort(found_.damages, {}, &Damage::offset);
    for (Damage& damage : found_.damages) findTimes(damage);
  }

  static bool holds(const std::vector<IntactRecord>& records, std::uint16_t id) {
    return std::ranges::any_of(records, [id](const IntactRecord& record) {
      return ByteReader(record.content).number<std::uint16_t>() == id;
    });
  }

  void findUndefined() {
    for (const std::uint16_t id : found_.used_channels) {
      if (!holds(found_.channels, id)) damaged(0, 0, fmt::format("the definition of channel {} is lost", id));
    }
    for (const IntactRecord& channel : found_.channels) {
      ByteReader reader(channel.content);
      reader.number<std::uint16_t>();
      const auto schema = reader.number<std::uint16_t>();
      if (schema != 0 && !holds(found_.schemas, schema)) {
        damaged(0, 0, fmt::format("the definition of schema {} is lost", schema));
      }
    }
  }

  /// Of several different definitions with the same id, uses that of the summary, which has a checksum.
  void settle(std::vector<IntactRecord>& records, const char* what) {
    std::map<std::uint16_t, IntactRecord> taken;
    for (IntactRecord& record : records) {
      const auto id = ByteReader(record.content).number<std::uint16_t>();
      const auto [place, is_new] = taken.emplace(id, record);
      if (is_new) continue;
      const bool better = summary_whole_ && record.offset > data_end_;
      damaged(better ? place->second.offset : record.offset, kRecordHeadBytes + record.content.size(),
              fmt::format("{} that differs from {} with the same number {}", what, what, id), !better);
      if (better) place->second = record;
    }
    records.clear();
    for (auto& [id, record] : taken) records.push_back(std::move(record));
  }

  /// In files with chunks, messages found after damage may be the remains of a chunk.
  void dropMessages() {
    const std::uint64_t first = found_.damages.empty() ? 0 : found_.damages.front().offset;
    const auto dropped =
        std::erase_if(found_.messages, [first](const IntactRecord& m) { return m.offset > first; });
    if (dropped > 0)
      damaged(first, 0, fmt::format("{} messages that may belong to a damaged chunk", dropped));
  }

  void compareWithSummary() {
    found_.messages_meant = messages_meant_;
    for (const IndexedChunk& expected : chunk_indexes_) {
      const auto is_it = [&expected](const IntactChunk& chunk) {
        return chunk.start_ns == expected.start_ns && chunk.end_ns == expected.end_ns &&
               chunk.bytes == expected.bytes;
      };
      const auto found = std::ranges::find_if(found_.chunks, is_it);
      const bool known = std::ranges::any_of(found_.damages, [&expected](const Damage& damage) {
        return damage.loses && damage.offset < expected.offset + expected.bytes &&
               expected.offset < damage.offset + damage.bytes;
      });
      if (found == found_.chunks.end() && !known) damaged(expected.offset, 0, "a chunk is missing");
      if (found != found_.chunks.end() && found->offset != expected.offset) {
        damaged(found->offset, found->bytes, "the position of a chunk does not match the summary", false);
      }
    }
  }

  void findTimes(Damage& damage) const {
    for (const IntactChunk& chunk : found_.chunks) {
      if (chunk.offset < damage.offset) damage.after_ns = std::max(damage.after_ns, chunk.end_ns);
      if (chunk.offset >= damage.offset + damage.bytes && chunk.offset != damage.offset) {
        damage.before_ns =
            damage.before_ns == 0 ? chunk.start_ns : std::min(damage.before_ns, chunk.start_ns);
      }
    }
  }

  const TraceFile& file_;
  std::uint64_t size_;
  const std::function<void(double)>& progress_;
  Salvage found_;
  std::optional<config::Error> failure_;
  std::uint64_t at_ = 0;
  std::uint64_t next_ = 0;          ///< offset of the next record if the one at `at_` is intact
  bool trusted_ = true;             ///< no damage so far
  bool has_all_checksums_ = false;  ///< a missing checksum then means damage
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

config::Result<Salvage> salvage(const TraceFile& file, std::uint64_t size,
                                const std::function<void(double)>& progress) {
  return Search(file, size, progress).run();
}

}  // namespace hapticd::drivers::mcap
