// SPDX-License-Identifier: Apache-2.0
#include "tests/support/strict_mcap.h"

#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "tests/support/file_content.h"
#include "tests/support/strict_mcap_bytes.h"

namespace hapticd::test {
namespace {

using namespace strict;

using Places = std::vector<std::pair<std::uint64_t, std::uint64_t>>;

struct Extent {
  std::uint64_t offset = 0, bytes = 0;
  auto operator<=>(const Extent&) const = default;
};

class StrictReading {
 public:
  explicit StrictReading(Bytes file) : file_(file) {}

  StrictMcap run() {
    if (!file_.starts_with(kMagicBytes)) fault(0, "the magic is missing");
    if (!file_.ends_with(kMagicBytes) || file_.size() < 2 * kMagicBytes.size()) {
      fault(file_.size(), "the closing magic is missing");
      return std::move(found_);
    }
    std::uint64_t at = kMagicBytes.size();
    const std::uint64_t end = file_.size() - kMagicBytes.size();
    while (at < end) {
      const std::optional<std::uint64_t> next = record(at, end);
      if (!next) return std::move(found_);
      at = *next;
    }
    if (!footer_) fault(at, "there is no footer");
    if (!data_end_) fault(at, "there is no DataEnd");
    return std::move(found_);
  }

 private:
  void fault(std::uint64_t at, const std::string& what) {
    found_.faults.push_back(fmt::format("byte {}: {}", at, what));
  }
  void require(bool holds, std::uint64_t at, const std::string& what) {
    if (!holds) fault(at, what);
  }

  std::optional<std::uint64_t> record(std::uint64_t at, std::uint64_t end) {
    Fields head(file_.substr(at, end - at));
    const auto opcode = static_cast<unsigned>(head.number(1));
    const std::uint64_t length = head.large();
    if (head.bad() || length > head.left()) {
      fault(at, "an incomplete record");
      return {};
    }
    const Bytes content = file_.substr(at + kHeadBytes, length);
    require(!footer_, at, "a record behind the footer");
    require((opcode == kHeader) == (at == kMagicBytes.size()), at, "the header is not the first record");
    if (opcode != kMessageIndex) endOfIndexes(at);
    if (data_end_) {
      summaryRecord(opcode, at, content);
    } else {
      dataRecord(opcode, at, content);
    }
    return at + kHeadBytes + length;
  }

  // -- Data section --

  void dataRecord(unsigned opcode, std::uint64_t at, Bytes content) {
    const Extent extent{at, kHeadBytes + content.size()};
    switch (opcode) {
      case kHeader:
        return header(at, content);
      case kSchema:
        return schema(at, content);
      case kChannel:
        return channel(at, content);
      case kChunk:
        return chunk(extent, content);
      case kMessageIndex:
        return messageIndex(at, content);
      case kAttachment:
        return attachment(extent, content);
      case kMetadata:
        return metadata(extent, content);
      case kDataEnd:
        return dataEnd(at, content);
      case kMessage:
        return fault(at, "a message outside of chunks");
      default:
        return fault(at, fmt::format("a record of the opcode {} in the data section", opcode));
    }
  }

  void header(std::uint64_t at, Bytes content) {
    Fields fields(content);
    fields.text();
    fields.text();
    require(fields.done(), at, "an incomplete header");
  }

  void define(std::map<std::uint16_t, std::string>& all, std::uint16_t id, std::uint64_t at, Bytes content) {
    const auto [place, is_new] = all.emplace(id, content);
    require(is_new || place->second == content, at,
            "a definition that differs from that of the same id before");
  }

  void schema(std::uint64_t at, Bytes content) {
    Fields fields(content);
    const std::uint16_t id = fields.id();
    fields.text();
    fields.text();
    fields.text();
    require(fields.done() && id != 0, at, "an incomplete schema, or has the id 0");
    define(schemas_, id, at, content);
  }

  void channel(std::uint64_t at, Bytes content) {
    Fields fields(content);
    const std::uint16_t id = fields.id(), schema = fields.id();
    fields.text();
    fields.text();
    map(fields.text(), at);
    require(fields.done(), at, "an incomplete channel");
    require(schema == 0 || schemas_.contains(schema), at, "a channel before its schema");
    define(channels_, id, at, content);
  }

  void map(Bytes content, std::uint64_t at) {
    std::set<Bytes> keys;
    Fields fields(content);
    while (fields.more()) {
      require(keys.insert(fields.text()).second, at, "a map with the same key twice");
      fields.text();
    }
    require(fields.done(), at, "an incomplete map");
  }

  std::optional<std::string> unpacked(std::uint64_t at, Bytes compression, Bytes records,
                                      std::uint64_t bytes) {
    if (compression.empty()) return std::string(records);
    if (compression != "zstd" || bytes > (1U << 28)) {
      fault(at, "a chunk of an unknown compression, or far too long");
      return {};
    }
    std::string to(bytes, '\0');
    if (::ZSTD_decompress(to.data(), to.size(), records.data(), records.size()) == bytes) return to;
    fault(at, "a chunk that cannot be decompressed");
    return {};
  }

  void chunk(Extent extent, Bytes content) {
    Fields fields(content);
    const std::uint64_t start_ns = fields.large(), end_ns = fields.large(), bytes = fields.large();
    const std::uint32_t crc = fields.small();
    const Bytes compression = fields.text(), records = fields.take(fields.large());
    if (!fields.done()) return fault(extent.offset, "an incomplete chunk");
    const auto unpacked = this->unpacked(extent.offset, compression, records, bytes);
    if (!unpacked) return;
    require(unpacked->size() == bytes, extent.offset, "a chunk whose length differs from the stated one");
    if (crc == 0 || crc != crc32(*unpacked))
      return fault(extent.offset, "the checksum of a chunk does not match");
    ++found_.chunks;
    chunkRecords(extent.offset, *unpacked);
    std::set<std::uint64_t> times_ns;
    for (const auto& [id, places] : indexed_) {
      for (const auto& place : places) times_ns.insert(place.first);
    }
    const std::uint64_t earliest = times_ns.empty() ? 0 : *times_ns.begin();
    const std::uint64_t latest = times_ns.empty() ? 0 : *times_ns.rbegin();
    require(start_ns == earliest && end_ns == latest, extent.offset,
            "the times of a chunk do not match those of its messages");
    if (!chunks_.empty() && !times_ns.empty() && earliest < latest_in_chunks_ns_) {
      found_.warnings.push_back(
          fmt::format("byte {}: a chunk that begins {} ns before the end of one before it", extent.offset,
                      latest_in_chunks_ns_ - earliest));
    }
    latest_in_chunks_ns_ = std::max(latest_in_chunks_ns_, latest);
    noteChunk(extent, {start_ns, end_ns}, compression, records.size(), bytes);
  }

  void chunkRecords(std::uint64_t chunk_at, Bytes records) {
    std::uint64_t last_ns = 0;
    for (Fields fields(records); fields.more();) {
      const std::uint64_t at = records.size() - fields.left();
      const auto opcode = static_cast<unsigned>(fields.number(1));
      const Bytes content = fields.take(fields.large());
      if (fields.bad()) return fault(chunk_at, "an incomplete chunk with a record");
      if (opcode == kSchema) {
        schema(chunk_at, content);
      } else if (opcode == kChannel) {
        channel(chunk_at, content);
      } else if (opcode == kMessage) {
        last_ns = message(chunk_at, at, content, last_ns);
      } else {
        fault(chunk_at, fmt::format("a record of the opcode {} in a chunk", opcode));
      }
    }
  }

  std::uint64_t message(std::uint64_t chunk_at, std::uint64_t at, Bytes content, std::uint64_t last_ns) {
    Fields fields(content);
    const std::uint16_t id = fields.id();
    fields.small();
    const std::uint64_t time_ns = fields.large();
    fields.large();
    if (fields.bad()) fault(chunk_at, "an incomplete message");
    require(channels_.contains(id), chunk_at, fmt::format("a message before its channel {}", id));
    require(time_ns >= last_ns, chunk_at, "the messages of a chunk are not in the order of time");
    indexed_[id].emplace_back(time_ns, at);
    ++counts_[id];
    earliest_ns_ = found_.messages.empty() ? time_ns : std::min(earliest_ns_, time_ns);
    latest_ns_ = std::max(latest_ns_, time_ns);
    found_.messages.emplace_back(id, time_ns, fields.take(fields.left()));
    return time_ns;
  }

  /// The position of its MessageIndex records is added when they have been read.
  void noteChunk(Extent extent, std::pair<std::uint64_t, std::uint64_t> times, Bytes compression,
                 std::uint64_t compressed, std::uint64_t bytes) {
    ChunkNote note;
    note.extent = extent;
    note.times = times;
    note.compression = compression;
    note.compressed = compressed;
    note.bytes = bytes;
    chunks_.push_back(std::move(note));
  }

  void messageIndex(std::uint64_t at, Bytes content) {
    Fields fields(content);
    const std::uint16_t id = fields.id();
    Fields places(fields.text());
    Places read;
    while (places.more()) {
      const std::uint64_t time_ns = places.large();
      read.emplace_back(time_ns, places.large());
    }
    require(fields.done() && places.done(), at, "an incomplete message index");
    require(std::ranges::is_sorted(read), at, "a message index that is not in the order of time");
    const auto expected = indexed_.find(id);
    if (expected == indexed_.end())
      return fault(at, fmt::format("a message index of channel {}, which is misplaced", id));
    require(read == expected->second, at, "a message index does not match its chunk");
    indexed_.erase(expected);
    if (chunks_.empty()) return;
    chunks_.back().indexes[id] = at;
    chunks_.back().index_bytes += kHeadBytes + content.size();
  }

  void endOfIndexes(std::uint64_t at) {
    require(indexed_.empty(), at, "a chunk without an index for each of its channels");
    indexed_.clear();
  }

  void attachment(Extent extent, Bytes content) {
    Fields fields(content);
    const std::uint64_t log_ns = fields.large(), create_ns = fields.large();
    const Bytes name = fields.text(), type = fields.text(), data = fields.take(fields.large());
    const Bytes covered =
        content.substr(0, content.size() - std::min<std::size_t>(content.size(), fields.left()));
    const std::uint32_t crc = fields.small();
    require(fields.done(), extent.offset, "an incomplete attachment");
    require(crc != 0 && crc == crc32(covered), extent.offset, "the checksum of an attachment does not match");
    attachments_.emplace(extent, log_ns, create_ns, data.size(), std::string(name), std::string(type));
  }

  void metadata(Extent extent, Bytes content) {
    Fields fields(content);
    const Bytes name = fields.text();
    map(fields.text(), extent.offset);
    require(fields.done(), extent.offset, "incomplete metadata");
    metadata_.emplace(extent, std::string(name));
  }

  void dataEnd(std::uint64_t at, Bytes content) {
    Fields fields(content);
    const std::uint32_t crc = fields.small();
    require(fields.done(), at, "an incomplete DataEnd");
    require(crc != 0 && crc == crc32(file_.substr(0, at)), at, "the checksum of the data does not match");
    data_end_ = at + kHeadBytes + content.size();
  }

  // -- Summary --

  void summaryRecord(unsigned opcode, std::uint64_t at, Bytes content) {
    if (opcode == kFooter) return footer(at, content);
    if (opcode != kSummaryOffset) group(opcode, at, kHeadBytes + content.size());
    switch (opcode) {
      case kSchema:
        return require(isDefined(schemas_, content) && repeated_schemas_.emplace(content).second, at,
                       "a schema in the summary that is none of the data");
      case kChannel:
        return require(isDefined(channels_, content) && repeated_channels_.emplace(content).second, at,
                       "a channel in the summary that is none of the data");
      case kStatistics:
        return statistics(at, content);
      case kChunkIndex:
        return chunkIndex(at, content);
      case kAttachmentIndex:
        return attachmentIndex(at, content);
      case kMetadataIndex:
        return metadataIndex(at, content);
      case kSummaryOffset:
        return summaryOffset(at, content);
      default:
        return fault(at, fmt::format("a record of the opcode {} in the summary", opcode));
    }
  }

  static bool isDefined(const std::map<std::uint16_t, std::string>& all, Bytes content) {
    const auto found = all.find(Fields(content).id());
    return found != all.end() && found->second == content;
  }

  void group(unsigned opcode, std::uint64_t at, std::uint64_t bytes) {
    require(!summary_offsets_at_, at, "a record of the summary behind its offsets");
    const bool same = !groups_.empty() && groups_.back().first == opcode;
    if (same) {
      groups_.back().second.bytes += bytes;
      return;
    }
    const auto isIt = [opcode](const auto& group) { return group.first == opcode; };
    require(std::ranges::none_of(groups_, isIt), at, "the summary is not grouped by opcode");
    groups_.push_back({opcode, {at, bytes}});
  }

  void statistics(std::uint64_t at, Bytes content) {
    Fields fields(content);
    const std::uint64_t messages = fields.large();
    const std::uint64_t schemas = fields.id(), channels = fields.small(), attachments = fields.small(),
                        metadata = fields.small(), chunks = fields.small();
    const std::uint64_t start_ns = fields.large(), end_ns = fields.large();
    std::map<std::uint16_t, std::uint64_t> counts;
    Fields entries(fields.text());
    while (entries.more()) {
      const std::uint16_t id = entries.id();
      counts[id] = entries.large();
    }
    require(fields.done() && entries.done(), at, "incomplete statistics");
    require(messages == found_.messages.size() && counts == counts_, at,
            "the statistics count other messages");
    require(schemas == schemas_.size() && channels == channels_.size(), at,
            "the statistics count other definitions");
    require(attachments == attachments_.size() && metadata == metadata_.size(), at,
            "the statistics count other attachments or metadata");
    require(chunks == chunks_.size(), at, "the statistics count other chunks");
    require(start_ns == earliest_ns_ && end_ns == latest_ns_, at, "the statistics have other times");
    has_statistics_ = true;
  }

  void chunkIndex(std::uint64_t at, Bytes content) {
    Fields fields(content);
    ChunkNote read;
    read.times.first = fields.large();
    read.times.second = fields.large();
    read.extent.offset = fields.large();
    read.extent.bytes = fields.large();
    Fields indexes(fields.text());
    while (indexes.more()) {
      const std::uint16_t id = indexes.id();
      read.indexes[id] = indexes.large();
    }
    read.index_bytes = fields.large();
    read.compression = fields.text();
    read.compressed = fields.large();
    read.bytes = fields.large();
    require(fields.done() && indexes.done(), at, "an incomplete chunk index");
    const auto found = std::ranges::find(chunks_, read.extent, &ChunkNote::extent);
    if (found == chunks_.end()) return fault(at, "a chunk index of a missing chunk");
    require(read == *found, at, "a chunk index does not match its chunk");
    require(indexed_chunks_.insert(read.extent).second, at, "a chunk that is indexed twice");
  }

  void attachmentIndex(std::uint64_t at, Bytes content) {
    Fields fields(content);
    const std::uint64_t offset = fields.large(), bytes = fields.large(), log_ns = fields.large(),
                        create_ns = fields.large(), size = fields.large();
    const Bytes name = fields.text(), type = fields.text();
    require(fields.done(), at, "an incomplete attachment index");
    const auto entry = std::tuple(Extent{offset, bytes}, log_ns, create_ns, std::size_t{size},
                                  std::string(name), std::string(type));
    require(attachments_.contains(entry) && indexed_attachments_.insert(offset).second, at,
            "an attachment index does not match");
  }

  void metadataIndex(std::uint64_t at, Bytes content) {
    Fields fields(content);
    const std::uint64_t offset = fields.large(), bytes = fields.large();
    const Bytes name = fields.text();
    require(fields.done(), at, "an incomplete metadata index");
    require(metadata_.contains({Extent{offset, bytes}, std::string(name)}) &&
                indexed_metadata_.insert(offset).second,
            at, "a metadata index does not match");
  }

  void summaryOffset(std::uint64_t at, Bytes content) {
    if (!summary_offsets_at_) summary_offsets_at_ = at;
    Fields fields(content);
    const auto opcode = static_cast<unsigned>(fields.number(1));
    const std::uint64_t start = fields.large(), bytes = fields.large();
    require(fields.done(), at, "an incomplete summary offset");
    const auto found = std::ranges::find(groups_, std::pair(opcode, Extent{start, bytes}));
    require(found != groups_.end() && offset_groups_.insert(opcode).second, at,
            "a summary offset does not match its group");
  }

  void footer(std::uint64_t at, Bytes content) {
    footer_ = true;
    Fields fields(content);
    const std::uint64_t summary = fields.large(), offsets = fields.large();
    const std::uint32_t crc = fields.small();
    require(fields.done(), at, "an incomplete footer");
    require(summary == *data_end_, at, "the summary does not begin behind DataEnd");
    require(offsets == summary_offsets_at_.value_or(0), at,
            "the summary's offsets are not at the position given in the footer");
    const std::uint64_t covered_to = at + kHeadBytes + 16;
    require(crc != 0 && summary <= at && crc == crc32(file_.substr(summary, covered_to - summary)), at,
            "the checksum of the summary does not match");
    require(has_statistics_, at, "there are no statistics");
    require(offset_groups_.size() == groups_.size(), at, "a group of the summary without an offset");
    require(repeated_schemas_.size() == schemas_.size() && repeated_channels_.size() == channels_.size(), at,
            "a definition that the summary does not repeat");
    require(indexed_chunks_.size() == chunks_.size(), at, "a chunk without an index");
    require(
        indexed_attachments_.size() == attachments_.size() && indexed_metadata_.size() == metadata_.size(),
        at, "attachments or metadata without an index");
  }

  struct ChunkNote {
    Extent extent;
    std::pair<std::uint64_t, std::uint64_t> times;
    std::map<std::uint16_t, std::uint64_t> indexes;
    std::uint64_t index_bytes = 0;
    std::string compression;
    std::uint64_t compressed = 0, bytes = 0;
    bool operator==(const ChunkNote&) const = default;
  };

  Bytes file_;
  StrictMcap found_;
  std::map<std::uint16_t, std::string> schemas_, channels_;
  std::map<std::uint16_t, Places> indexed_;  ///< of the last chunk, not indexed yet
  std::map<std::uint16_t, std::uint64_t> counts_;
  std::uint64_t earliest_ns_ = 0, latest_ns_ = 0;
  std::uint64_t latest_in_chunks_ns_ = 0;
  std::vector<ChunkNote> chunks_;
  std::set<std::tuple<Extent, std::uint64_t, std::uint64_t, std::size_t, std::string, std::string>>
      attachments_;
  std::set<std::pair<Extent, std::string>> metadata_;
  std::optional<std::uint64_t> data_end_;  ///< end of the data section
  // of the summary
  std::vector<std::pair<unsigned, Extent>> groups_;
  std::optional<std::uint64_t> summary_offsets_at_;
  std::set<std::string, std::less<>> repeated_schemas_, repeated_channels_;
  std::set<Extent> indexed_chunks_;
  std::set<std::uint64_t> indexed_attachments_, indexed_metadata_;
  std::set<unsigned> offset_groups_;
  bool has_statistics_ = false;
  bool footer_ = false;
};

}  // namespace

std::string StrictMcap::text() const {
  std::string text;
  for (const std::string& fault : faults) text += fault + "\n";
  return text;
}

std::string StrictMcap::allText() const {
  std::string text = this->text();
  for (const std::string& warning : warnings) text += "warning: " + warning + "\n";
  return text;
}

StrictMcap readStrictly(const std::filesystem::path& file) {
  const std::string bytes = contentOf(file);
  return StrictReading(bytes).run();
}

}  // namespace hapticd::test
