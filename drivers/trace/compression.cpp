#include "drivers/trace/compression.h"

#include <zstd.h>

namespace hapticd::drivers {

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

bool decompress(std::string_view bytes, std::size_t length, std::string& to) {
  return decompressUpTo(bytes, length, to) && to.size() == length;
}

bool decompressUpTo(std::string_view bytes, std::size_t most_bytes, std::string& to) {
  const unsigned long long length = ::ZSTD_getFrameContentSize(bytes.data(), bytes.size());
  const bool known = length != ZSTD_CONTENTSIZE_UNKNOWN && length != ZSTD_CONTENTSIZE_ERROR;
  if (!known || length > most_bytes) return false;
  to.resize(length);
  return ::ZSTD_decompress(to.data(), to.size(), bytes.data(), bytes.size()) == length;
}

}  // namespace hapticd::drivers
