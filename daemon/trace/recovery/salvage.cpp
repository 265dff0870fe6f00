// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/recovery/trace_recovery.h"

#include <algorithm>
#include <map>
#include <utility>

#include "daemon/trace/mcap/mcap_reader.h"

namespace hapticd::trace::mcap {
namespace {

/// Reads parts of a file, and remembers the first error of the system.
class FileBytes {
 public:
  FileBytes(const TraceFile& file, std::uint64_t size) : file_(file), size_(size) {}

  std::string at(std::uint64_t offset, std::uint64_t length) {
    std::string to;
    if (auto read = file_.readAt(offset, std::min(length, size_ - std::min(size_, offset)), to); !read) {
      failure_ = read.error();
      to.clear();
    }
    return to;
  }
  /// Returns nothing if no whole record can begin there.
  std::optional<RecordHead> head(std::uint64_t offset) {
    const std::string begin = at(offset, kRecordHeadBytes);
    if (begin.size() < kRecordHeadBytes) return {};
    ByteReader reader(begin);
    const auto opcode = static_cast<Opcode>(reader.number<std::uint8_t>());
    const auto length = reader.number<std::uint64_t>();
    const bool known = opcode >= Opcode::header && opcode <= Opcode::data_end;
    const std::uint64_t room = size_ - offset - kRecordHeadBytes;
    if (!known || length > room || length > kMaxRecordBytes) return {};
    return RecordHead{opcode, offset, length};
  }
  std::string content(const RecordHead& record) {
    return at(record.offset + kRecordHeadBytes, record.length);
  }
  std::uint32_t crc(std::uint64_t from, std::uint64_t to) {
    const auto crc = crcOf(file_, from, to);
    if (!crc) failure_ = crc.error();
    return crc.value_or(0);
  }

  std::uint64_t size() const { return size_; }
  const std::optional<base::Error>& failure() const { return failure_; }

 private:
  const TraceFile& file_;
  std::uint64_t size_;
  std::optional<base::Error> failure_;
};

/// Adds a definition unless its id has one.
void define(std::map<std::uint16_t, IntactRecord>& all, std::uint64_t offset, std::string content) {
  const auto id = ByteReader(content).number<std::uint16_t>();
  all.try_emplace(id, IntactRecord{offset, std::move(content)});
}

/// The summary of a file, if its checksum matches.
class IntactSummary {
 public:
  static std::optional<IntactSummary> of(FileBytes& bytes) {
    constexpr std::uint64_t kDataEndBytes = kRecordHeadBytes + sizeof(std::uint32_t);
    constexpr std::uint64_t kEnding = kRecordHeadBytes + kFooterBytes + kMagic.size();
    if (bytes.size() < kEnding || bytes.at(bytes.size() - kMagic.size(), kMagic.size()) != kMagic) return {};
    const auto footer = bytes.head(bytes.size() - kEnding);
    if (!footer || footer->opcode != Opcode::footer || footer->length != kFooterBytes) return {};
    const std::string content = bytes.content(*footer);
    ByteReader reader(content);
    const auto begin = reader.number<std::uint64_t>();
    reader.number<std::uint64_t>();  // of the summary offsets
    const auto crc = reader.number<std::uint32_t>();
    if (begin < kDataEndBytes || begin > footer->offset) return {};
    if (crc != bytes.crc(begin, footer->end() - sizeof crc)) return {};
    IntactSummary summary;
    summary.data_end = begin - kDataEndBytes;
    for (std::uint64_t at = begin; at < footer->offset;) {
      const auto record = bytes.head(at);
      if (!record) return {};
      summary.take(*record, bytes.content(*record));
      at = record->end();
    }
    return summary;
  }

  std::map<std::uint16_t, IntactRecord> schemas, channels;
  std::uint64_t messages = 0;
  std::uint64_t data_end = 0;  ///< where the DataEnd record begins

  /// Returns where the next chunk after `offset` begins that has the length that the summary states; where
  /// the data end if there is none.
  std::uint64_t nextChunk(FileBytes& bytes, std::uint64_t offset) {
    if (next_ > offset) return next_;
    for (auto chunk = chunks_.upper_bound(offset); chunk != chunks_.end(); chunk = chunks_.erase(chunk)) {
      const auto head = bytes.head(chunk->first);
      const bool there = head && head->opcode == Opcode::chunk && head->end() - head->offset == chunk->second;
      if (there) return next_ = chunk->first;
    }
    return data_end;
  }

 private:
  void take(const RecordHead& record, std::string content) {
    ByteReader reader(content);
    if (record.opcode == Opcode::schema) {
      define(schemas, record.offset, std::move(content));
    } else if (record.opcode == Opcode::channel) {
      define(channels, record.offset, std::move(content));
    } else if (record.opcode == Opcode::statistics) {
      messages = reader.number<std::uint64_t>();
    } else if (record.opcode == Opcode::chunk_index) {
      reader.raw(2 * sizeof(std::uint64_t));  // its times
      const auto offset = reader.number<std::uint64_t>();
      chunks_.emplace(offset, reader.number<std::uint64_t>());
    }
  }

  std::map<std::uint64_t, std::uint64_t> chunks_;  ///< length of the record by its offset
  std::uint64_t next_ = 0;                         ///< the last one that nextChunk() has found
};

class Walk {
 public:
  Walk(const TraceFile& file, std::uint64_t size, const GoesOn& goes_on)
      : file_(file), bytes_(file, size), allowance_(size), goes_on_(goes_on), end_(size) {}

  base::Result<Salvage> run() {
    found_.file_bytes = bytes_.size();
    summary_ = IntactSummary::of(bytes_);
    if (summary_) end_ = summary_->data_end;
    if (bytes_.at(0, kMagic.size()) != kMagic) {
      damaged(0, kMagic.size(), "the first bytes of the file are not those of MCAP");
    }
    for (at_ = kMagic.size(); at_ < end_ && !bytes_.failure();) {
      step();
      if (goes_on_ && !goes_on_(static_cast<double>(at_) / static_cast<double>(bytes_.size()))) {
        return std::unexpected(interrupted(file_.path()));
      }
    }
    if (!bytes_.failure()) finish();
    if (bytes_.failure()) return std::unexpected(*bytes_.failure());
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

  void step() {
    const std::uint64_t begin = at_;
    const auto record = bytes_.head(begin);
    const std::uint64_t next = summary_ ? summary_->nextChunk(bytes_, begin) : end_;
    // There may be many records whose wrong length reaches to the end of the file: they are not read.
    const bool length_is_right = record && record->end() <= next;
    const std::string wrong = length_is_right ? take(*record) : "an incomplete record";
    if (wrong.empty() || bytes_.failure()) return;
    at_ = length_is_right && mayContinueAt(record->end()) ? record->end() : next;
    damaged(begin, at_ - begin, wrong);
    lost_to_ = at_;
  }

  bool mayContinueAt(std::uint64_t offset) { return offset >= end_ || bytes_.head(offset); }

  /// Processes a record and goes on behind it. Returns a description of its fault, or "".
  std::string take(const RecordHead& record) {
    switch (record.opcode) {
      case Opcode::header:
        if (record.offset != kMagic.size()) return "a misplaced header";
        break;
      case Opcode::chunk:
        return chunk(record, bytes_.content(record));
      case Opcode::message_index:
        if (record.offset != lost_to_) return "an index without its chunk";
        at_ = lost_to_ = record.end();  // it belongs to a damaged chunk
        return "";
      case Opcode::data_end:
        return dataEnd(record);
      default:
        if (std::string wrong = companion(record, bytes_.content(record)); !wrong.empty()) return wrong;
    }
    accept(record.end());
    return "";
  }

  void accept(std::uint64_t to) {
    at_ = to;
    intact_to_ = found_.damages.empty() ? to : 0;
  }

  /// A record in front of the chunks. What has no checksum is trusted if it has its form and fills the
  /// record: hapticd writes no fields of later versions.
  std::string companion(const RecordHead& record, std::string content) {
    SchemaRecord schema;
    ChannelRecord channel;
    MetadataRecord metadata;
    AttachmentRecord attachment;
    switch (record.opcode) {
      case Opcode::schema:
        if (!SchemaRecord::of(content, schema) || schema.bytes < content.size())
          return "an incomplete schema";
        define(found_.schemas, record.offset, std::move(content));
        return "";
      case Opcode::channel:
        if (!ChannelRecord::of(content, channel) || channel.bytes < content.size())
          return "an incomplete channel";
        define(found_.channels, record.offset, std::move(content));
        return "";
      case Opcode::metadata:
        if (!MetadataRecord::of(content, metadata) || metadata.bytes < content.size())
          return "incomplete metadata";
        found_.metadata.push_back({record.offset, std::move(content)});
        return "";
      case Opcode::attachment:
        if (std::string wrong = AttachmentRecord::of(content, attachment); !wrong.empty()) return wrong;
        if (attachment.crc == 0) return "an attachment without checksum";
        if (attachment.bytes < content.size()) return "an incomplete attachment";
        found_.attachments.push_back({record.offset, std::move(content)});
        return "";
      default:
        return "a record where hapticd writes none of its type";
    }
  }

  std::string chunk(const RecordHead& record, const std::string& content) {
    std::string records;
    ChunkRecord chunk;
    ChunkContent inside;
    if (!ChunkRecord::of(content, chunk) || chunk.bytes < content.size()) return "an incomplete chunk";
    if (chunk.crc == 0) return "a chunk without checksum";
    if (std::string wrong = chunk.unpack(records, allowance_); !wrong.empty()) return wrong;
    // The definitions of a new file are those of the summary or in front of the chunks.
    if (!ChunkContent::of(records, inside) || (inside.defines && !summary_))
      return "a chunk that contains something other than messages";
    if (chunk.start_ns != inside.start_ns || chunk.end_ns != inside.end_ns) {
      damaged(record.offset, 0, "the times of a chunk do not match those of its messages", false);
    }
    for (const auto& [channel, places] : inside.messages) {
      found_.used_channels.insert(channel);
      found_.messages_whole += places.size();
    }
    accept(record.end());
    const std::string index = inside.indexRecords();
    const bool indexed = bytes_.at(record.end(), index.size()) == index;
    found_.chunks.push_back({record.offset, record.end() - record.offset, inside.start_ns, inside.end_ns});
    found_.chunk_summary.addChunk(record.offset, record.end() - record.offset, chunk, inside);
    if (indexed) {
      accept(record.end() + index.size());
    } else {
      found_.missing_indexes = index;
      skipIndex(index.size());
    }
    return "";
  }

  /// Indexes can be rebuilt from their chunk. Where no record follows them, they are not of that length.
  void skipIndex(std::uint64_t length) {
    const std::uint64_t to = std::min(at_ + length, end_);
    const std::uint64_t skipped = mayContinueAt(to) ? to - at_ : 0;
    damaged(at_, skipped, "the index of a chunk is damaged or incomplete", false);
    at_ += skipped;
  }

  /// Behind the end of the data, the file is rebuilt.
  std::string dataEnd(const RecordHead& record) {
    if (record.length != sizeof(std::uint32_t)) return "an incomplete DataEnd";
    end_ = record.offset;
    return "";
  }

  void finish() {
    const auto data_end = bytes_.head(end_);
    if (found_.damages.empty() && data_end && data_end->opcode == Opcode::data_end) {
      const std::string content = bytes_.content(*data_end);
      const auto crc = ByteReader(content).number<std::uint32_t>();
      if (crc != bytes_.crc(0, end_)) {
        damaged(0, end_,
                "the checksum of the data does not match, although all chunks and attachments do: the "
                "header, schemas, channels, metadata or indexes have changed");
        intact_to_ = 0;
      }
    }
    if (summary_) {
      found_.schemas = std::move(summary_->schemas);
      found_.channels = std::move(summary_->channels);
      found_.messages_meant = summary_->messages;
    } else {
      damaged(end_, 0, "the end of the file is missing or damaged", false);
    }
    if (intact_to_ > 0) found_.intact_to = intact_to_;
    findTimes();
  }

  void findTimes() {
    const std::vector<IntactChunk>& chunks = found_.chunks;
    for (Damage& damage : found_.damages) {
      const auto after = std::ranges::upper_bound(chunks, damage.offset, {}, &IntactChunk::offset);
      if (after != chunks.begin()) damage.after_ns = std::prev(after)->end_ns;
      if (after != chunks.end()) damage.before_ns = after->start_ns;
    }
  }

  const TraceFile& file_;
  FileBytes bytes_;
  std::optional<IntactSummary> summary_;
  Allowance allowance_;
  const GoesOn& goes_on_;
  Salvage found_;
  std::uint64_t at_ = 0;
  std::uint64_t end_;            ///< of the data, as far as it is known
  std::uint64_t lost_to_ = 0;    ///< end of the last damaged record and its indexes
  std::uint64_t intact_to_ = 0;  ///< 0: something intact follows on damage
};

}  // namespace

base::Error interrupted(const std::filesystem::path& file) {
  return {file.string(), "was not finished, because the program ends", "it is tried again"};
}

base::Result<std::uint32_t> crcOf(const TraceFile& file, std::uint64_t from, std::uint64_t to) {
  constexpr std::uint64_t kPieceBytes = 1 << 20;
  std::uint32_t crc = 0;
  std::string bytes;
  for (; from < to; from += kPieceBytes) {
    if (auto read = file.readAt(from, std::min(kPieceBytes, to - from), bytes); !read) {
      return std::unexpected(read.error());
    }
    crc = crcOf(bytes, crc);
  }
  return crc;
}

base::Result<Salvage> salvage(const TraceFile& file, std::uint64_t size, const GoesOn& goes_on) {
  return Walk(file, size, goes_on).run();
}

}  // namespace hapticd::trace::mcap
