// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/files/byte_stream.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>

#include "tools/lib/solids/files/source_file.h"

namespace hapticd::solids {

/// Owns zlib's state.
struct ByteStream::Gzip {
  Gzip() { is_ready = inflateInit2(&state, 15 + 16) == Z_OK; }  // 16: a gzip header
  ~Gzip() {
    if (is_ready) inflateEnd(&state);
  }
  Gzip(const Gzip&) = delete;
  Gzip& operator=(const Gzip&) = delete;

  z_stream state{};
  bool is_ready = false;
  bool has_ended = false;
};

ByteStream::ByteStream(std::string_view bytes, bool is_gzip, const std::string& name)
    : bytes_(bytes), size_(bytes.size()), name_(name), gzip_(is_gzip ? std::make_unique<Gzip>() : nullptr) {}

ByteStream::~ByteStream() = default;

base::Result<std::size_t> ByteStream::read(std::span<char> room) {
  constexpr std::size_t kPiece = std::size_t{1} << 26;  // zlib takes at most 4 GiB at a time
  if (!gzip_) {
    const std::size_t count = bytes_.copy(room.data(), room.size());
    bytes_.remove_prefix(count);
    return count;
  }
  if (!gzip_->is_ready) return refused(name_, "zlib cannot start", "free some memory");
  z_stream& state = gzip_->state;
  std::size_t made = 0;
  while (made < room.size() && !gzip_->has_ended) {
    const std::size_t input = std::min(kPiece, bytes_.size()), space = std::min(kPiece, room.size() - made);
    // zlib does not write to its input
    state.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(bytes_.data()));
    state.avail_in = static_cast<uInt>(input);
    state.next_out = reinterpret_cast<Bytef*>(room.data() + made);
    state.avail_out = static_cast<uInt>(space);
    const int status = ::inflate(&state, Z_NO_FLUSH);
    const std::size_t used = input - state.avail_in, got = space - state.avail_out;
    bytes_.remove_prefix(used);
    made += got;
    if (status == Z_STREAM_END) {
      // another member may follow; zeros that fill the last block of a tape are not one
      gzip_->has_ended = bytes_.find_first_not_of('\0') == std::string_view::npos;
      if (!gzip_->has_ended && inflateReset(&state) != Z_OK)
        return refused(name_, "zlib cannot go on", "free some memory");
      continue;
    }
    const bool is_stuck = used == 0 && got == 0;
    if (status == Z_OK && !is_stuck) continue;
    const bool is_short = bytes_.empty() && (status == Z_OK || status == Z_BUF_ERROR);
    return refused(
        fmt::format("{}: byte {} of the compressed data", name_, size_ - bytes_.size()),
        is_short ? "the compressed data end too early"
                 : fmt::format("the compressed data are damaged ({})",
                               state.msg == nullptr ? "not gzip" : state.msg),
        is_short ? "the file is truncated: copy or write it again" : "copy or write the file again");
  }
  return made;
}

}  // namespace hapticd::solids
