// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/mcap/mcap_writer.h"

#include <algorithm>
#include <limits>

namespace hapticd::trace::mcap {
namespace {

/// The record of an attachment without its data, which may be too large for a copy.
struct AroundAttachment {
  std::string before, behind;

  explicit AroundAttachment(const AttachmentRecord& attachment) {
    ByteWriter writer(before);
    before.push_back(static_cast<char>(Opcode::attachment));
    const std::size_t texts =
        2 * sizeof(std::uint32_t) + attachment.name.size() + attachment.media_type.size();
    writer.number(
        std::uint64_t{3 * sizeof(std::uint64_t) + texts + attachment.data.size() + sizeof(std::uint32_t)});
    writer.put(attachment.log_time_ns, attachment.create_time_ns, attachment.name, attachment.media_type,
               std::uint64_t{attachment.data.size()});
    ByteWriter(behind).number(
        crcOf(attachment.data, crcOf(std::string_view(before).substr(kRecordHeadBytes))));
  }
};

std::string metadataRecord(std::string_view name, TextPairs pairs) {
  std::string record;
  addRecord(record, Opcode::metadata, [&] {
    ByteWriter(record).text(name);
    addPairs(record, pairs);
  });
  return record;
}

}  // namespace

Writer::Writer(TraceFile part, std::filesystem::path file, bool compress, std::string_view profile,
               Durable durable)
    : part_(std::move(part)), file_(std::move(file)), durable_(durable), head_(kMagic) {
  if (compress) compressor_.emplace();
  addRecord(head_, Opcode::header, [this, profile] { ByteWriter(head_).put(profile, "hapticd"); });
}

std::uint16_t Writer::addChannel(std::string_view topic, std::string_view schema_name,
                                 std::string_view schema, TextPairs metadata) {
  const std::uint16_t id = ++channels_;
  const std::size_t schema_at = head_.size();
  mcap::addSchema(head_, id, schema_name, schema);
  summary_.add(Opcode::schema, schema_at, std::string_view(head_).substr(schema_at + kRecordHeadBytes));
  const std::size_t channel_at = head_.size();
  mcap::addChannel(head_, id, id, topic, metadata);
  summary_.add(Opcode::channel, channel_at, std::string_view(head_).substr(channel_at + kRecordHeadBytes));
  return id;
}

void Writer::addMetadata(std::string_view name, TextPairs pairs) {
  add(Opcode::metadata, std::string_view(metadataRecord(name, pairs)).substr(kRecordHeadBytes));
}

void Writer::add(Opcode opcode, std::string_view content) {
  summary_.add(opcode, head_.size(), content);
  addRecord(head_, opcode, [&] { head_ += content; });
}

void Writer::addAttachment(const AttachmentRecord& attachment) {
  const AroundAttachment around(attachment);
  const std::size_t offset = head_.size();
  head_.append(around.before).append(attachment.data).append(around.behind);
  summary_.addAttachment(offset, head_.size() - offset, attachment);
}

base::Result<void> Writer::begin() {
  auto written = append({head_});
  if (written) written = part_.synchronise();
  if (written) written = synchroniseFolder(file_.parent_path());
  return written;
}

base::Result<void> Writer::appendBetweenChunks(Parts record) {
  if (failure_) return std::unexpected(*failure_);
  auto written = append(record);
  if (written) return {};
  failure_ = written.error();
  pending_.clear();
  places_.clear();
  return written;
}

base::Result<void> Writer::attach(const AttachmentRecord& attachment) {
  const AroundAttachment around(attachment);
  const std::uint64_t offset = end_;
  if (auto written = appendBetweenChunks({around.before, attachment.data, around.behind}); !written)
    return written;
  summary_.addAttachment(offset, end_ - offset, attachment);
  return {};
}

base::Result<void> Writer::describe(std::string_view name, TextPairs pairs) {
  const std::string record = metadataRecord(name, pairs);
  const std::uint64_t offset = end_;
  if (auto written = appendBetweenChunks({record}); !written) return written;
  summary_.add(Opcode::metadata, offset, std::string_view(record).substr(kRecordHeadBytes));
  return {};
}

void Writer::addMessage(std::uint16_t channel, std::uint32_t sequence, std::uint64_t time_ns,
                        std::string_view message) {
  const std::size_t at = pending_.size();
  const std::uint64_t log_time_ns = std::max(time_ns, chunks_end_ns_);
  addRecord(pending_, Opcode::message, [&] {
    ByteWriter writer(pending_);
    writer.put(channel, sequence, log_time_ns, time_ns);
    writer.raw(message);
  });
  earliest_ns_ = places_.empty() ? log_time_ns : std::min(earliest_ns_, log_time_ns);
  places_.push_back({log_time_ns, channel, at, pending_.size() - at});
}

std::uint64_t Writer::pendingMessages(std::uint16_t channel) const {
  return static_cast<std::uint64_t>(std::ranges::count(places_, channel, &Pending::channel));
}

/// Returns the records of pending messages up to `time_ns` in the order of their times; the others stay
/// pending.
std::string Writer::takeUpTo(std::uint64_t time_ns) {
  const auto later = std::ranges::stable_partition(
      places_, [time_ns](const Pending& place) { return place.time_ns <= time_ns; });
  std::vector<Pending> taken(places_.begin(), later.begin());
  std::ranges::stable_sort(taken, {}, &Pending::time_ns);
  std::string records, left;
  for (const Pending& place : taken) records.append(pending_, place.offset, place.bytes);
  places_.erase(places_.begin(), later.begin());
  for (Pending& place : places_) {
    const std::size_t offset = left.size();
    left.append(pending_, place.offset, place.bytes);
    place.offset = offset;
  }
  pending_ = std::move(left);
  if (!places_.empty()) earliest_ns_ = std::ranges::min(places_, {}, &Pending::time_ns).time_ns;
  return records;
}

/// Writes all of it or nothing.
base::Result<void> Writer::append(Parts parts) {
  std::uint64_t end = end_;
  base::Result<void> written;
  for (const std::string_view part : parts) {
    if (written) written = part_.writeAt(end, part);
    end += part.size();
  }
  if (written && durable_ == Durable::each_chunk) written = part_.synchronise();
  if (!written) {
    (void)part_.truncate(end_);
    return written;
  }
  for (const std::string_view part : parts) crc_ = crcOf(part, crc_);
  end_ = end;
  return {};
}

base::Result<void> Writer::write(const std::string& records) {
  ChunkContent content;
  ChunkContent::of(records, content);
  const bool compressed = compressor_ && compressRecords(*compressor_, records, compressed_);
  return addChunk({content.start_ns, content.end_ns, records.size(), crcOf(records), compressed ? "zstd" : "",
                   compressed ? compressed_ : records},
                  content);
}

base::Result<void> Writer::addChunk(const ChunkRecord& chunk, const ChunkContent& content) {
  std::string bytes;
  mcap::addChunk(bytes, chunk);
  const std::uint64_t offset = end_, length = bytes.size();
  auto written = append({bytes, content.indexRecords()});
  if (!written) return written;
  summary_.addChunk(offset, length, chunk, content);
  chunks_end_ns_ = content.end_ns;
  return {};
}

base::Result<void> Writer::flush() {
  return flushUpTo(std::numeric_limits<std::uint64_t>::max());
}

base::Result<void> Writer::flushUpTo(std::uint64_t time_ns) {
  if (failure_) return std::unexpected(*failure_);
  const std::string records = takeUpTo(time_ns);
  if (records.empty()) return {};
  auto written = write(records);
  if (written) return {};
  failure_ = written.error();
  pending_.clear();
  places_.clear();
  return written;
}

base::Result<void> Writer::writeEnding() {
  auto written = part_.truncate(end_);  // removes what an earlier error may have left
  if (written) written = part_.writeAt(end_, summary_.ending(end_, crc_));
  if (written) written = part_.synchronise();
  if (!written) (void)part_.truncate(end_);
  return written;
}

base::Result<void> Writer::finish() {
  if (finished_) return {};
  const auto flushed = failure_ ? base::Result<void>{} : flush();
  auto ended = writeEnding();
  if (ended) ended = renameDurably(part_.path(), file_);
  std::error_code ignored;
  finished_ = !std::filesystem::exists(part_.path(), ignored);
  return ended ? flushed : ended;
}

base::Result<void> Writer::end() {
  if (auto flushed = flush(); !flushed) return flushed;
  return writeEnding();
}

}  // namespace hapticd::trace::mcap
