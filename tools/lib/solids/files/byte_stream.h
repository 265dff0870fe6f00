// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "config/base/error.h"

namespace hapticd::solids {

/// Bytes one piece after the other: as they are, or of a gzip stream of one member or more. Decompressing
/// takes no memory beyond the piece.
class ByteStream {
 public:
  /// `bytes` must outlive it. `name`: of the file, for messages.
  ByteStream(std::string_view bytes, bool is_gzip, const std::string& name);
  ~ByteStream();

  /// Returns how many bytes it put into `room`: fewer than fit only where the stream ends, whose checksum is
  /// right then. Errors: not gzip, damaged, truncated.
  base::Result<std::size_t> read(std::span<char> room);

 private:
  struct Gzip;

  std::string_view bytes_;  ///< not yet taken
  std::size_t size_;
  std::string name_;
  std::unique_ptr<Gzip> gzip_;
};

}  // namespace hapticd::solids
