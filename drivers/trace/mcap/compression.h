// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

namespace hapticd::drivers {

/// zstd compression with reusable buffers.
/// Thread: one.  RT: not safe.
class Compressor {
 public:
  Compressor();
  ~Compressor();
  Compressor(const Compressor&) = delete;
  Compressor& operator=(const Compressor&) = delete;

  /// Compresses `bytes` to one zstd frame in `to`. Returns false if that is not shorter or memory is
  /// exhausted.
  bool compress(std::string_view bytes, std::string& to);

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

// Decompresses `bytes` to exactly `length` bytes in `to`. Returns false if they are not frames of that
// compression or contain another number of bytes. Memory grows with the actual output, not with `length`.
bool decompressZstd(std::string_view bytes, std::size_t length, std::string& to);
bool decompressLz4(std::string_view bytes, std::size_t length, std::string& to);

/// Decompresses a zstd frame of unknown content size to `to`. Returns false if it is invalid or its content
/// is longer than `max_bytes`; no memory is allocated for such content.
bool decompressUpTo(std::string_view bytes, std::size_t max_bytes, std::string& to);

}  // namespace hapticd::drivers
