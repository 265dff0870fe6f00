#include "drivers/trace/mcap_scanner.h"

#include <fmt/format.h>

#include <algorithm>

namespace hapticd::drivers::mcap {
namespace {

std::unexpected<Fault> unreadable(config::Error error) {
  return std::unexpected(Fault{Fault::Kind::unreadable, std::move(error)});
}

Fault cut(const std::filesystem::path& file, std::uint64_t offset) {
  return {Fault::Kind::cut,
          {fmt::format("{} at byte {}", file.string(), offset), "the trace is cut off",
           "it is still being written, or hapticd or the machine stopped meanwhile: stop the trace, or "
           "recover the file with hapticctl trace recover"}};
}

}  // namespace

std::expected<Scanner, Fault> Scanner::open(const std::filesystem::path& path) {
  auto file = TraceFile::openToRead(path);
  if (!file) return unreadable(file.error());
  const auto size = file->size();
  if (!size) return unreadable(size.error());
  Scanner scanner(std::move(*file), *size);
  const auto magic = scanner.peek(kMagic.size());
  if (!magic) return std::unexpected(magic.error());
  if (!kMagic.starts_with(*magic)) {
    return std::unexpected(scanner.foreign("is no MCAP file", "give a trace of hapticd"));
  }
  if (magic->size() < kMagic.size()) return std::unexpected(cut(path, magic->size()));
  scanner.skip(kMagic);
  return scanner;
}

Fault Scanner::damaged(std::uint64_t offset, std::string_view what) const {
  return {Fault::Kind::damaged,
          {fmt::format("{} at byte {}", file_.path().string(), offset), std::string(what),
           "the file is damaged; hapticctl trace recover keeps what is before that"}};
}

Fault Scanner::foreign(std::string_view what, std::string_view remedy) const {
  return {Fault::Kind::foreign, {file_.path().string(), std::string(what), std::string(remedy)}};
}

std::expected<Record, Fault> Scanner::next() {
  const auto head = peek(kRecordHeadBytes);
  if (!head) return std::unexpected(head.error());
  if (head->size() < kRecordHeadBytes) return std::unexpected(cut(file_.path(), offset_));
  ByteReader reader(*head);
  Record record{.opcode = static_cast<Opcode>(reader.number<std::uint8_t>()),
                .offset = offset_,
                .content = {},
                .crc = crc_};
  const auto length = reader.number<std::uint64_t>();
  if (length > kMostRecordBytes) {
    return std::unexpected(
        damaged(offset_, fmt::format("a record of {} bytes; at most {} are read", length, kMostRecordBytes)));
  }
  if (length > size_ - offset_ - kRecordHeadBytes) return std::unexpected(cut(file_.path(), offset_));
  if (auto read = file_.readAt(offset_ + kRecordHeadBytes, length, content_); !read) {
    return unreadable(read.error());
  }
  if (content_.size() < length) return std::unexpected(cut(file_.path(), offset_));
  record.content = content_;
  skip(*head);
  skip(content_);
  return record;
}

std::expected<bool, Fault> Scanner::atClosingMagic() {
  const auto rest = peek(kMagic.size() + 1);
  if (!rest) return std::unexpected(rest.error());
  if (*rest == kMagic) return true;
  if (kMagic.starts_with(*rest)) return std::unexpected(cut(file_.path(), offset_));
  return std::unexpected(damaged(offset_, "there is something else than the end of the file"));
}

std::expected<std::string, Fault> Scanner::peek(std::size_t length) const {
  std::string bytes;
  if (auto read = file_.readAt(offset_, length, bytes); !read) return unreadable(read.error());
  return bytes;
}

void Scanner::skip(std::string_view bytes) {
  crc_ = crcOf(bytes, crc_);
  offset_ += bytes.size();
}

}  // namespace hapticd::drivers::mcap
