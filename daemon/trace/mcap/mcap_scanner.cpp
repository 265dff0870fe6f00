// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/mcap/mcap_scanner.h"

#include <fmt/format.h>

#include <algorithm>

namespace hapticd::trace::mcap {
namespace {

std::unexpected<Fault> unreadable(base::Error error) {
  return std::unexpected(Fault{Fault::Kind::unreadable, std::move(error)});
}

Fault cut(const std::filesystem::path& file, std::uint64_t offset) {
  const std::string where = fmt::format("{} at byte {}", file.string(), offset);
  if (isBeingWritten(file)) {
    return {Fault::Kind::cut,
            {where, "the trace is still being written", "stop it first, e.g. with hapticctl trace stop"}};
  }
  return {Fault::Kind::cut,
          {where, "the trace is truncated",
           "hapticd or the machine stopped while it was written, or the copy is incomplete: hapticctl trace "
           "recover saves the intact parts to a new file"}};
}

}  // namespace

base::Error outOfMemory(const std::filesystem::path& file) {
  return {file.string(), "reading it takes more memory than there is",
          "end other programs, or read it on another computer"};
}

std::expected<Scanner, Fault> Scanner::open(const std::filesystem::path& path) {
  auto file = TraceFile::openToRead(path);
  if (!file) return unreadable(file.error());
  const auto size = file->size();
  if (!size) return unreadable(size.error());
  Scanner scanner(std::move(*file), *size);
  const auto magic = scanner.peek(kMagic.size());
  if (!magic) return std::unexpected(magic.error());
  if (!kMagic.starts_with(*magic)) {
    return std::unexpected(scanner.foreign("is not an MCAP file", "give a trace of hapticd"));
  }
  if (magic->size() < kMagic.size()) return std::unexpected(cut(path, magic->size()));
  scanner.skip(kMagic);
  return scanner;
}

Fault Scanner::damaged(std::uint64_t offset, std::string_view what) const {
  return {Fault::Kind::damaged,
          {fmt::format("{} at byte {}", file_.path().string(), offset), std::string(what),
           "the file is damaged; hapticctl trace recover saves the intact parts to a new file"}};
}

Fault Scanner::foreign(std::string_view what, std::string_view remedy) const {
  return {Fault::Kind::foreign, {file_.path().string(), std::string(what), std::string(remedy)}};
}

std::expected<RecordHead, Fault> Scanner::head() const {
  const auto bytes = peek(kRecordHeadBytes);
  if (!bytes) return std::unexpected(bytes.error());
  if (bytes->size() < kRecordHeadBytes) return std::unexpected(cut(file_.path(), offset_));
  ByteReader reader(*bytes);
  RecordHead head{.opcode = static_cast<Opcode>(reader.number<std::uint8_t>()), .offset = offset_};
  head.length = reader.number<std::uint64_t>();
  if (head.length > size_ - offset_ - kRecordHeadBytes) return std::unexpected(cut(file_.path(), offset_));
  if (head.length > kMaxRecordBytes) {
    return std::unexpected(damaged(
        offset_, fmt::format("a record of {} bytes; at most {} are accepted", head.length, kMaxRecordBytes)));
  }
  return head;
}

std::expected<Record, Fault> Scanner::next() {
  const auto head = this->head();
  if (!head) return std::unexpected(head.error());
  std::string& bytes = content_;
  if (auto there = read(offset_, kRecordHeadBytes + head->length, bytes); !there) {
    return std::unexpected(there.error());
  }
  if (bytes.size() < kRecordHeadBytes + head->length) return std::unexpected(cut(file_.path(), offset_));
  const Record record{.opcode = head->opcode,
                      .offset = offset_,
                      .content = std::string_view(bytes).substr(kRecordHeadBytes),
                      .crc = crc_};
  skip(bytes);
  return record;
}

std::expected<bool, Fault> Scanner::atClosingMagic() {
  const auto rest = peek(kMagic.size() + 1);
  if (!rest) return std::unexpected(rest.error());
  if (*rest == kMagic) return true;
  if (kMagic.starts_with(*rest)) return std::unexpected(cut(file_.path(), offset_));
  return std::unexpected(damaged(offset_, "the end of the file has unexpected bytes"));
}

std::expected<void, Fault> Scanner::read(std::uint64_t offset, std::size_t length, std::string& to) const {
  if (auto read = file_.readAt(offset, length, to); !read) return unreadable(read.error());
  return {};
}

std::expected<std::string, Fault> Scanner::peek(std::size_t length) const {
  std::string bytes;
  if (auto there = read(offset_, length, bytes); !there) return std::unexpected(there.error());
  return bytes;
}

void Scanner::restart() {
  offset_ = 0;
  crc_ = 0;
  skip(kMagic);
}

void Scanner::skip(std::string_view bytes) {
  crc_ = crcOf(bytes, crc_);
  offset_ += bytes.size();
}

}  // namespace hapticd::trace::mcap
