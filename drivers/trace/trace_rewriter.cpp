// SPDX-License-Identifier: Apache-2.0
#include "drivers/trace/trace_rewriter.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "drivers/trace/compression.h"
#include "drivers/trace/mcap_definitions.h"
#include "drivers/trace/mcap_summary.h"

namespace hapticd::drivers {
namespace {

using mcap::ByteReader;
using mcap::ByteWriter;
using mcap::IntactChunk;
using mcap::IntactRecord;
using mcap::Opcode;

std::uint16_t idOf(const IntactRecord& record) {
  return ByteReader(record.content).number<std::uint16_t>();
}

/// `records`: sorted by id.
bool holds(const std::vector<IntactRecord>& records, std::uint16_t id) {
  return std::ranges::binary_search(records, id, {}, idOf);
}

/// A decompressed chunk of a file.
struct Unpacked {
  std::string record;  ///< content of the record
  std::string records;
  mcap::ChunkRecord chunk;
  mcap::ChunkContent content;

  /// Reads a chunk that was intact when the file was scanned.
  config::Result<void> read(const TraceFile& file, const IntactChunk& whole, mcap::Allowance& allowance) {
    if (auto there =
            file.readAt(whole.offset + mcap::kRecordHeadBytes, whole.bytes - mcap::kRecordHeadBytes, record);
        !there) {
      return there;
    }
    const bool good = mcap::ChunkRecord::of(record, chunk) && chunk.unpack(records, allowance).empty() &&
                      mcap::ChunkContent::of(records, content);
    if (good) return {};
    return std::unexpected(
        config::Error{file.path().string(), "was modified while it was read", "try again"});
  }
};

/// A file that grows at its end.
class Growing {
 public:
  Growing(TraceFile& file, std::uint64_t end, std::uint32_t crc) : file_(file), end_(end), crc_(crc) {}

  config::Result<void> append(std::string_view bytes) {
    auto written = file_.writeAt(end_, bytes);
    crc_ = mcap::crcOf(bytes, crc_);
    end_ += bytes.size();
    return written;
  }
  std::uint64_t end() const { return end_; }
  std::uint32_t crc() const { return crc_; }

 private:
  TraceFile& file_;
  std::uint64_t end_;
  std::uint32_t crc_;
};

/// The beginning of a new file, and its summary.
class Head {
 public:
  Head(const mcap::Salvage& whole, mcap::Summary& summary) : summary_(summary), bytes_(mcap::kMagic) {
    mcap::addRecord(bytes_, Opcode::header, [this] {
      ByteWriter writer(bytes_);
      writer.text("");
      writer.text("hapticd");
    });
    for (const IntactRecord& schema : whole.schemas) addSchema(schema.content);
    for (const IntactRecord& channel : whole.channels) addChannel(channel.content, whole);
    for (const std::uint16_t id : whole.used_channels) {
      if (!holds(whole.channels, id)) addUnknownChannel(id);
    }
    for (const IntactRecord& metadata : whole.metadata) {
      const auto [offset, bytes] = add(Opcode::metadata, metadata.content);
      summary_.addMetadata(offset, bytes, metadata.content);
    }
    for (const IntactRecord& record : whole.attachments) {
      const auto [offset, bytes] = add(Opcode::attachment, record.content);
      mcap::AttachmentRecord attachment;
      mcap::AttachmentRecord::of(record.content, attachment);
      summary_.addAttachment(offset, bytes, attachment);
    }
  }

  const std::string& bytes() const { return bytes_; }

 private:
  std::pair<std::uint64_t, std::uint64_t> add(Opcode opcode, std::string_view content) {
    const std::uint64_t offset = bytes_.size();
    mcap::addRecord(bytes_, opcode, [&] { bytes_ += content; });
    return {offset, bytes_.size() - offset};
  }
  void addSchema(std::string_view content) {
    add(Opcode::schema, content);
    summary_.addSchema(content);
  }
  void addChannelRecord(std::string_view content) {
    add(Opcode::channel, content);
    summary_.addChannel(content);
  }
  /// A channel whose schema is lost keeps its messages.
  void addChannel(std::string content, const mcap::Salvage& whole) {
    constexpr std::size_t kSchemaAt = sizeof(std::uint16_t);
    mcap::ChannelRecord channel;
    mcap::ChannelRecord::of(content, channel);
    if (!holds(whole.schemas, channel.schema)) content.replace(kSchemaAt, sizeof channel.schema, 2, '\0');
    addChannelRecord(content);
  }
  void addUnknownChannel(std::uint16_t id) {
    std::string record;
    mcap::addChannel(record, id, 0, fmt::format("/lost_channel_{}", id));
    addChannelRecord(std::string_view(record).substr(mcap::kRecordHeadBytes));
  }

  mcap::Summary& summary_;
  std::string bytes_;
};

/// Packs messages outside of chunks into chunks; a file with chunks then has all its messages in them.
std::vector<std::string> asChunks(std::vector<IntactRecord> messages) {
  constexpr std::size_t kChunkBytes = 1 << 20;
  const auto time_ns = [](const IntactRecord& record) {
    mcap::MessageRecord message;
    mcap::MessageRecord::of(record.content, message);
    return message.time_ns;
  };
  std::ranges::stable_sort(messages, {}, time_ns);
  std::vector<std::string> chunks;
  for (const IntactRecord& message : messages) {
    if (chunks.empty() || chunks.back().size() >= kChunkBytes) chunks.emplace_back();
    mcap::addRecord(chunks.back(), Opcode::message, [&] { chunks.back() += message.content; });
  }
  return chunks;
}

class Rewriting {
 public:
  Rewriting(TraceFile& out, const mcap::Salvage& whole) : whole_(whole), file_(out, 0, 0) {}

  config::Result<void> run(const TraceFile& from, const mcap::GoesOn& goes_on) {
    auto written = file_.append(Head(whole_, summary_).bytes());
    mcap::Allowance allowance(whole_.file_bytes);
    std::vector<IntactChunk> chunks = whole_.chunks;
    std::ranges::stable_sort(chunks, {}, &IntactChunk::start_ns);
    for (std::size_t i = 0; i < chunks.size() && written; ++i) {
      Unpacked chunk;
      written = chunk.read(from, chunks[i], allowance);
      if (written) written = add(chunk.chunk, chunk.records, chunk.content);
      const double done = static_cast<double>(i + 1) / static_cast<double>(chunks.size());
      if (goes_on && !goes_on(done)) return std::unexpected(mcap::interrupted(from.path()));
    }
    for (const std::string& records : asChunks(whole_.messages)) {
      mcap::ChunkContent content;
      mcap::ChunkContent::of(records, content);
      if (written) written = add({0, 0, records.size(), 0, "", records}, records, content);
    }
    if (written) written = file_.append(summary_.ending(file_.end(), file_.crc()));
    return written;
  }

 private:
  /// Times and checksum are computed from the records.
  config::Result<void> add(mcap::ChunkRecord chunk, std::string_view records,
                           const mcap::ChunkContent& content) {
    if (!content.schemas.empty() || !content.channels.empty()) return addMessagesOf(records);
    chunk.start_ns = content.start_ns;
    chunk.end_ns = content.end_ns;
    chunk.crc = mcap::crcOf(records);
    std::string bytes;
    mcap::addChunk(bytes, chunk);
    summary_.addChunk(file_.end(), bytes.size(), chunk, content);
    return file_.append(bytes + content.indexRecords());
  }

  /// All consistent definitions are at the beginning of the file.
  config::Result<void> addMessagesOf(std::string_view records) {
    std::string messages, compressed;
    mcap::visitRecords(records, [&](Opcode opcode, std::string_view content, std::uint64_t) {
      if (opcode == Opcode::message) mcap::addRecord(messages, opcode, [&] { messages += content; });
      return true;
    });
    if (messages.empty()) return {};
    mcap::ChunkContent content;
    mcap::ChunkContent::of(messages, content);
    const bool shorter = mcap::compressRecords(compressor_, messages, compressed);
    return add({0, 0, messages.size(), 0, shorter ? "zstd" : "", shorter ? compressed : messages}, messages,
               content);
  }

  const mcap::Salvage& whole_;
  Growing file_;
  mcap::Summary summary_;
  Compressor compressor_;
};

/// Computes the checksum of the beginning of a file.
config::Result<std::uint32_t> crcUpTo(const TraceFile& file, std::uint64_t end) {
  constexpr std::uint64_t kPieceBytes = 1 << 20;
  std::uint32_t crc = 0;
  std::string bytes;
  for (std::uint64_t at = 0; at < end; at += kPieceBytes) {
    if (auto read = file.readAt(at, std::min(kPieceBytes, end - at), bytes); !read) {
      return std::unexpected(read.error());
    }
    crc = mcap::crcOf(bytes, crc);
  }
  return crc;
}

config::Result<mcap::Summary> summaryInPlace(const TraceFile& file, const mcap::Salvage& whole,
                                             const mcap::GoesOn& goes_on) {
  mcap::Summary summary;
  mcap::Allowance allowance(whole.file_bytes);
  for (const IntactRecord& schema : whole.schemas) summary.addSchema(schema.content);
  for (const IntactRecord& channel : whole.channels) summary.addChannel(channel.content);
  for (const IntactRecord& metadata : whole.metadata) {
    summary.addMetadata(metadata.offset, mcap::kRecordHeadBytes + metadata.content.size(), metadata.content);
  }
  for (const IntactRecord& record : whole.attachments) {
    mcap::AttachmentRecord attachment;
    mcap::AttachmentRecord::of(record.content, attachment);
    summary.addAttachment(record.offset, mcap::kRecordHeadBytes + record.content.size(), attachment);
  }
  for (const IntactChunk& place : whole.chunks) {
    Unpacked chunk;
    if (auto read = chunk.read(file, place, allowance); !read) return std::unexpected(read.error());
    summary.addChunk(place.offset, place.bytes, chunk.chunk, chunk.content);
    const double done = static_cast<double>(place.offset) / static_cast<double>(whole.file_bytes);
    if (goes_on && !goes_on(done)) return std::unexpected(mcap::interrupted(file.path()));
  }
  return summary;
}

/// Returns the indexes of the last chunk if they are incomplete.
config::Result<std::string> missingIndexes(const TraceFile& file, const mcap::Salvage& whole) {
  if (whole.chunks.empty() || whole.chunks.back().indexed) return std::string();
  Unpacked chunk;
  mcap::Allowance allowance(whole.file_bytes);
  if (auto read = chunk.read(file, whole.chunks.back(), allowance); !read) {
    return std::unexpected(read.error());
  }
  return chunk.content.indexRecords();
}

}  // namespace

config::Result<void> rewriteTrace(const TraceFile& from, const mcap::Salvage& whole,
                                  const std::filesystem::path& out, const mcap::GoesOn& goes_on) {
  std::error_code ignored;
  if (std::filesystem::exists(out, ignored)) {
    return std::unexpected(
        config::Error{out.string(), "already exists", "give another name, or move it away"});
  }
  const std::filesystem::path part = out.string() + ".rewriting";
  if (!isBeingWritten(part)) std::filesystem::remove(part, ignored);  // left by an interrupted attempt
  auto file = TraceFile::create(part);
  if (!file) return std::unexpected(file.error());
  auto done = Rewriting(*file, whole).run(from, goes_on);
  if (done) done = file->synchronise();
  if (done) done = renameDurably(part, out);
  if (!done) std::filesystem::remove(part, ignored);
  return done;
}

config::Result<void> endTrace(TraceFile& file, const mcap::Salvage& whole, std::uint64_t intact_to,
                              const mcap::GoesOn& goes_on) {
  const auto summary = summaryInPlace(file, whole, goes_on);
  if (!summary) return std::unexpected(summary.error());
  const auto indexes = missingIndexes(file, whole);
  if (!indexes) return std::unexpected(indexes.error());
  const auto crc = crcUpTo(file, intact_to);
  if (!crc) return std::unexpected(crc.error());
  auto done = file.truncate(intact_to);
  Growing end(file, intact_to, *crc);
  if (done) done = end.append(*indexes);
  if (done) done = end.append(summary->ending(end.end(), end.crc()));
  if (done) done = file.synchronise();
  if (!done) (void)file.truncate(intact_to);
  return done;
}

}  // namespace hapticd::drivers
