// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

namespace hapticd::drivers {

/// zstd with buffers that are kept. Thread: one.  RT: not safe.
class Compressor {
 public:
  Compressor();
  ~Compressor();
  Compressor(const Compressor&) = delete;
  Compressor& operator=(const Compressor&) = delete;

  /// `to`: `bytes` as one zstd frame. False: that is not shorter (or there is no memory for it).
  bool compress(std::string_view bytes, std::string& to);

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

// `to`: exactly `length` bytes out of frames of that compression. False: they are none, or hold another
// number of bytes. Memory grows with what comes out of them, not with what `length` says.
bool decompressZstd(std::string_view bytes, std::size_t length, std::string& to);
bool decompressLz4(std::string_view bytes, std::size_t length, std::string& to);

/// `to`: what a zstd frame holds, of a length that is not known before. False: it is none, or longer than
/// `most_bytes`; then no memory was taken for it.
bool decompressUpTo(std::string_view bytes, std::size_t most_bytes, std::string& to);

}  // namespace hapticd::drivers
