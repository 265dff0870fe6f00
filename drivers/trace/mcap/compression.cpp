// SPDX-License-Identifier: Apache-2.0
#include "drivers/trace/mcap/compression.h"

#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <optional>

namespace hapticd::drivers {
namespace {

/// Collects the output of `step(room, length)`, which returns the number of bytes written, 0 at the end, or
/// nothing if the input is invalid.
template <typename Step>
bool collect(std::size_t length, std::string& to, Step step) {
  constexpr std::size_t kPieceBytes = 1 << 18;
  to.clear();
  while (true) {
    const std::size_t at = to.size();
    to.resize(at + std::min(kPieceBytes, length - at + 1));  // one byte more, to detect excess output
    const std::optional<std::size_t> written = step(to.data() + at, to.size() - at);
    if (!written) return false;
    to.resize(at + *written);
    if (to.size() > length) return false;
    if (*written == 0) return to.size() == length;
  }
}

}  // namespace

struct Compressor::Context {
  ZSTD_CCtx* zstd = ::ZSTD_createCCtx();
  ~Context() { ::ZSTD_freeCCtx(zstd); }
};

Compressor::Compressor() : context_(std::make_unique<Context>()) {}
Compressor::~Compressor() = default;

bool Compressor::compress(std::string_view bytes, std::string& to) {
  if (context_->zstd == nullptr || bytes.empty()) return false;
  to.resize(::ZSTD_compressBound(bytes.size()));
  const std::size_t length = ::ZSTD_compressCCtx(context_->zstd, to.data(), to.size(), bytes.data(),
                                                 bytes.size(), ZSTD_CLEVEL_DEFAULT);
  if (::ZSTD_isError(length) != 0 || length >= bytes.size()) return false;
  to.resize(length);
  return true;
}

bool decompressZstd(std::string_view bytes, std::size_t length, std::string& to) {
  const std::unique_ptr<ZSTD_DCtx, decltype(&::ZSTD_freeDCtx)> context(::ZSTD_createDCtx(), &::ZSTD_freeDCtx);
  if (!context) return false;
  ZSTD_inBuffer in{bytes.data(), bytes.size(), 0};
  std::size_t missing = 0;  // input still missing; 0 at the end of a frame
  return collect(length, to, [&](char* room, std::size_t size) -> std::optional<std::size_t> {
    ZSTD_outBuffer out{room, size, 0};
    while (out.pos == 0 && (missing != 0 || in.pos < in.size)) {
      const std::size_t before = in.pos;
      missing = ::ZSTD_decompressStream(context.get(), &out, &in);
      if (::ZSTD_isError(missing) != 0) return std::nullopt;
      const bool stuck = out.pos == 0 && in.pos == before;
      if (stuck && missing != 0) return std::nullopt;  // the last frame is truncated
    }
    return out.pos;
  });
}

bool decompressLz4(std::string_view bytes, std::size_t length, std::string& to) {
  LZ4F_dctx* created = nullptr;
  if (::LZ4F_isError(::LZ4F_createDecompressionContext(&created, LZ4F_VERSION)) != 0) return false;
  const std::unique_ptr<LZ4F_dctx, decltype(&::LZ4F_freeDecompressionContext)> context(
      created, &::LZ4F_freeDecompressionContext);
  std::size_t missing = 0;  // input still missing; 0 at the end of a frame
  return collect(length, to, [&](char* room, std::size_t size) -> std::optional<std::size_t> {
    std::size_t written = 0;
    while (written == 0 && (missing != 0 || !bytes.empty())) {
      std::size_t taken = bytes.size();
      written = size;
      missing = ::LZ4F_decompress(context.get(), room, &written, bytes.data(), &taken, nullptr);
      if (::LZ4F_isError(missing) != 0) return std::nullopt;
      if (written == 0 && taken == 0 && missing != 0) return std::nullopt;  // the last frame is truncated
      bytes.remove_prefix(taken);
    }
    return written;
  });
}

bool decompressUpTo(std::string_view bytes, std::size_t max_bytes, std::string& to) {
  const unsigned long long length = ::ZSTD_getFrameContentSize(bytes.data(), bytes.size());
  const bool known = length != ZSTD_CONTENTSIZE_UNKNOWN && length != ZSTD_CONTENTSIZE_ERROR;
  return known && length <= max_bytes && decompressZstd(bytes, length, to);
}

}  // namespace hapticd::drivers
