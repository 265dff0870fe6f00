// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/files/inflate.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <limits>

#include "tools/lib/solids/files/source_file.h"

namespace hapticd::solids {
namespace {

/// Owns zlib's state.
class GzipStream {
 public:
  GzipStream() { is_ready_ = inflateInit2(&state_, 15 + 16) == Z_OK; }  // 16: a gzip header
  ~GzipStream() {
    if (is_ready_) inflateEnd(&state_);
  }
  GzipStream(const GzipStream&) = delete;
  GzipStream& operator=(const GzipStream&) = delete;
  bool isReady() const { return is_ready_; }
  z_stream& state() { return state_; }

 private:
  z_stream state_{};
  bool is_ready_ = false;
};

/// zlib takes at most 4 GiB at a time.
constexpr std::size_t kPiece = std::size_t{1} << 26;

}  // namespace

base::Result<Inflated> inflated(std::string_view stream, std::size_t longest, const std::string& name) {
  GzipStream gzip;
  if (!gzip.isReady()) return refused(name, "zlib cannot start", "free some memory");
  z_stream& state = gzip.state();
  Inflated result;
  std::size_t taken = 0, made = 0;
  // one byte more than wanted: either it exists, or the stream ends there and its checksum is compared
  while (made <= longest) {
    if (made == result.bytes.size())
      result.bytes.resize(std::min(longest + 1, std::max<std::size_t>(2 * made, std::size_t{1} << 16)));
    const std::size_t input = std::min(kPiece, stream.size() - taken);
    const std::size_t room = std::min(kPiece, result.bytes.size() - made);
    // zlib does not write to its input
    state.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(stream.data() + taken));
    state.avail_in = static_cast<uInt>(input);
    state.next_out = reinterpret_cast<Bytef*>(result.bytes.data() + made);
    state.avail_out = static_cast<uInt>(room);
    const int status = ::inflate(&state, Z_NO_FLUSH);
    const std::size_t used = input - state.avail_in, got = room - state.avail_out;
    taken += used;
    made += got;
    if (status == Z_STREAM_END) {
      // another member may follow; zeros that fill the last block of a tape are not one
      if (taken == stream.size() || stream.substr(taken).find_first_not_of('\0') == std::string_view::npos)
        break;
      if (inflateReset(&state) != Z_OK) return refused(name, "zlib cannot go on", "free some memory");
      continue;
    }
    const bool is_stuck = used == 0 && got == 0;
    if (status == Z_OK && !is_stuck) continue;
    const bool is_short = taken == stream.size() && (status == Z_OK || status == Z_BUF_ERROR);
    return refused(
        fmt::format("{}: byte {} of the compressed data", name, taken),
        is_short ? "the compressed data end too early"
                 : fmt::format("the compressed data are damaged ({})",
                               state.msg == nullptr ? "not gzip" : state.msg),
        is_short ? "the file is truncated: copy or write it again" : "copy or write the file again");
  }
  result.has_more = made > longest;
  result.bytes.resize(std::min(made, longest));
  return result;
}

}  // namespace hapticd::solids
