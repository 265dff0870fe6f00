// SPDX-License-Identifier: Apache-2.0
#include "drivers/trace/mcap_record_places.h"

#include <algorithm>

namespace hapticd::drivers::mcap {

bool isKnown(Opcode opcode) {
  return opcode >= Opcode::header && opcode <= Opcode::data_end;
}

std::string FileBytes::at(std::uint64_t offset, std::uint64_t length) {
  std::string to;
  if (auto read = file_.readAt(offset, std::min(length, size_ - std::min(size_, offset)), to); !read) {
    failure_ = read.error();
    to.clear();
  }
  return to;
}

std::optional<RecordPlace> FileBytes::head(std::uint64_t offset) {
  const std::string begin = at(offset, kRecordHeadBytes);
  if (begin.size() < kRecordHeadBytes) return {};
  ByteReader reader(begin);
  const auto opcode = static_cast<Opcode>(reader.number<std::uint8_t>());
  const auto length = reader.number<std::uint64_t>();
  const std::uint64_t room = size_ - offset - kRecordHeadBytes;
  if (opcode == Opcode{} || length > room || length > kMaxRecordBytes) return {};
  return RecordPlace{opcode, offset, offset + kRecordHeadBytes + length};
}

bool FileBytes::isClosingMagic(std::uint64_t offset) {
  return offset + kMagic.size() == size_ && at(offset, kMagic.size()) == kMagic;
}

bool FileBytes::mayContinueAt(std::uint64_t offset) {
  constexpr std::uint64_t kMaxLength = std::uint64_t{1} << 40;  // of any file
  if (offset >= size_ || isClosingMagic(offset)) return true;
  const std::string begin = at(offset, kRecordHeadBytes);
  ByteReader reader(begin);
  if (!isKnown(static_cast<Opcode>(reader.number<std::uint8_t>()))) return head(offset).has_value();
  const auto length = reader.number<std::uint64_t>();
  return !reader.good() || length < kMaxLength;
}

std::uint32_t FileBytes::crc(std::uint64_t from, std::uint64_t to) {
  constexpr std::uint64_t kWindowBytes = 1 << 20;
  std::uint32_t crc = 0;
  for (; from < to && !failure_; from += kWindowBytes) {
    crc = crcOf(at(from, std::min(kWindowBytes, to - from)), crc);
  }
  return crc;
}

IndexedChunk IndexedChunk::of(std::string_view content) {
  ByteReader reader(content);
  IndexedChunk chunk;
  chunk.start_ns = reader.number<std::uint64_t>();
  chunk.end_ns = reader.number<std::uint64_t>();
  chunk.offset = reader.number<std::uint64_t>();
  chunk.bytes = reader.number<std::uint64_t>();
  return chunk;
}

ChunkPlaces::ChunkPlaces(FileBytes& bytes) : bytes_(bytes) {
  constexpr std::uint64_t kDataEndBytes = kRecordHeadBytes + sizeof(std::uint32_t);
  constexpr std::uint64_t kEnding = kRecordHeadBytes + kFooterBytes + kMagic.size();
  if (bytes.size() < kEnding || !bytes.isClosingMagic(bytes.size() - kMagic.size())) return;
  const std::uint64_t footer_at = bytes.size() - kEnding;
  const auto footer = bytes.head(footer_at);
  if (!footer || footer->opcode != Opcode::footer || footer->length() != kFooterBytes) return;
  const std::string content = bytes.content(*footer);
  ByteReader reader(content);
  const auto summary_at = reader.number<std::uint64_t>();
  reader.number<std::uint64_t>();
  const auto crc = reader.number<std::uint32_t>();
  if (summary_at < kDataEndBytes || summary_at > footer_at) return;
  if (crc != 0 && crc != bytes.crc(summary_at, footer->end - sizeof crc)) return;
  data_end_ = summary_at - kDataEndBytes;
  for (std::uint64_t at = summary_at; at < footer_at;) {
    const auto record = bytes.head(at);
    if (!record) return;
    if (record->opcode == Opcode::chunk_index) {
      const IndexedChunk chunk = IndexedChunk::of(bytes.content(*record));
      places_.emplace(chunk.offset, chunk.bytes);
    }
    at = record->end;
  }
}

bool ChunkPlaces::mayBe(const RecordPlace& chunk) const {
  const auto found = places_.find(chunk.begin);
  return data_end_ == 0 || (found != places_.end() && found->second == chunk.end - chunk.begin);
}

std::optional<std::uint64_t> ChunkPlaces::next(std::uint64_t offset) {
  for (auto place = places_.upper_bound(offset); place != places_.end(); place = places_.erase(place)) {
    const auto head = bytes_.head(place->first);
    if (head && head->opcode == Opcode::chunk && mayBe(*head)) return place->first;
  }
  if (data_end_ <= offset) return {};
  const auto end = bytes_.head(data_end_);
  return end && end->opcode == Opcode::data_end ? std::optional(data_end_) : std::nullopt;
}

}  // namespace hapticd::drivers::mcap
