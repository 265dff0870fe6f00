#include "drivers/trace/mcap_writer.h"

namespace hapticd::drivers::mcap {

Writer::Writer(TraceFile part, std::filesystem::path file, bool compress)
    : part_(std::move(part)), file_(std::move(file)), head_(kMagic) {
  if (compress) compressor_.emplace();
  addRecord(head_, Opcode::header, [this] {
    ByteWriter writer(head_);
    writer.text("");  // no profile: that of ROS 2 asks for qualities of service
    writer.text("hapticd");
  });
}

std::uint16_t Writer::addChannel(std::string_view topic, std::string_view schema_name,
                                 std::string_view schema) {
  const std::uint16_t id = ++channels_;
  const std::size_t schema_at = head_.size();
  mcap::addSchema(head_, id, schema_name, schema);
  summary_.addSchema(std::string_view(head_).substr(schema_at + kRecordHeadBytes));
  const std::size_t channel_at = head_.size();
  mcap::addChannel(head_, id, id, topic);
  summary_.addChannel(std::string_view(head_).substr(channel_at + kRecordHeadBytes));
  return id;
}

void Writer::addMetadata(std::string_view name, Pairs pairs) {
  const std::size_t at = head_.size();
  addRecord(head_, Opcode::metadata, [&] {
    ByteWriter writer(head_);
    writer.text(name);
    writer.sized<std::uint32_t>([&] {
      for (const auto& [key, value] : pairs) {
        writer.text(key);
        writer.text(value);
      }
    });
  });
  summary_.addMetadata(at, head_.size() - at, std::string_view(head_).substr(at + kRecordHeadBytes));
}

void Writer::addAttachment(const AttachmentRecord& attachment) {
  const std::size_t at = head_.size();
  addRecord(head_, Opcode::attachment, [&] {
    ByteWriter writer(head_);
    writer.number(attachment.log_time_ns);
    writer.number(attachment.create_time_ns);
    writer.text(attachment.name);
    writer.text(attachment.media_type);
    writer.sized<std::uint64_t>([&] { writer.raw(attachment.data); });
    writer.number(crcOf(std::string_view(head_).substr(at + kRecordHeadBytes)));
  });
  summary_.addAttachment(at, head_.size() - at, attachment);
}

config::Result<void> Writer::begin() {
  auto written = append(head_);
  if (written) written = part_.synchronise();
  if (written) written = synchroniseFolder(file_.parent_path());
  return written;
}

void Writer::addMessage(std::uint16_t channel, std::uint32_t sequence, std::uint64_t time_ns,
                        std::string_view message) {
  addRecord(chunk_, Opcode::message, [&] {
    ByteWriter writer(chunk_);
    writer.number(channel);
    writer.number(sequence);
    writer.number(time_ns);
    writer.number(time_ns);
    writer.raw(message);
  });
}

/// All of it, or nothing.
config::Result<void> Writer::append(std::string_view bytes) {
  auto written = part_.writeAt(end_, bytes);
  if (written) written = part_.synchronise();
  if (!written) {
    (void)part_.truncate(end_);
    return written;
  }
  crc_ = crcOf(bytes, crc_);
  end_ += bytes.size();
  return {};
}

config::Result<void> Writer::writeChunk() {
  ChunkContent content;
  ChunkContent::of(chunk_, content);
  const bool compressed = compressor_ && compressor_->compress(chunk_, compressed_);
  const ChunkRecord chunk{content.start_ns, content.end_ns,           chunk_.size(),
                          crcOf(chunk_),    compressed ? "zstd" : "", compressed ? compressed_ : chunk_};
  std::string bytes;
  addRecord(bytes, Opcode::chunk, [&] {
    ByteWriter writer(bytes);
    writer.number(chunk.start_ns);
    writer.number(chunk.end_ns);
    writer.number(chunk.uncompressed_bytes);
    writer.number(chunk.crc);
    writer.text(chunk.compression);
    writer.sized<std::uint64_t>([&] { writer.raw(chunk.records); });
  });
  const std::uint64_t offset = end_, length = bytes.size();
  auto written = append(bytes + content.indexRecords());
  if (written) summary_.addChunk(offset, length, chunk, content);
  return written;
}

config::Result<void> Writer::flush() {
  if (failure_) return std::unexpected(*failure_);
  if (chunk_.empty()) return {};
  auto written = writeChunk();
  chunk_.clear();
  if (!written) failure_ = written.error();
  return written;
}

config::Result<void> Writer::writeEnding() {
  auto written = part_.truncate(end_);  // what an error has left, if that could not be done then
  if (written) written = part_.writeAt(end_, summary_.ending(end_, crc_));
  if (written) written = part_.synchronise();
  if (!written) (void)part_.truncate(end_);
  return written;
}

config::Result<void> Writer::finish() {
  if (finished_) return {};
  const auto flushed = failure_ ? config::Result<void>{} : flush();
  auto ended = writeEnding();
  if (ended) ended = renameDurably(part_.path(), file_);
  std::error_code ignored;
  finished_ = !std::filesystem::exists(part_.path(), ignored);
  return ended ? flushed : ended;
}

}  // namespace hapticd::drivers::mcap
