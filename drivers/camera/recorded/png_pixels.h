// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace hapticd::drivers {

/// Reads a PNG image from a stream, with the pixels as they are in the file, without colour management.
/// Thread: one.  RT: not safe.
class PngPixels {
 public:
  struct Header {
    std::uint32_t width_px = 0;
    std::uint32_t height_px = 0;
    int bits = 0;  ///< of each channel
    bool grey = false;
  };

  /// `stream`: at the beginning of the file; it outlives the object.
  explicit PngPixels(std::FILE* stream);
  ~PngPixels();
  PngPixels(const PngPixels&) = delete;
  PngPixels& operator=(const PngPixels&) = delete;

  /// Reads the header. False: the file is damaged, see fault().
  bool readHeader(Header& header);
  /// Reads an image of 16-bit greys into `rows`, one pointer for each row, after readHeader(). False: the
  /// file is damaged or truncated, see fault().
  bool readRows(std::vector<std::uint16_t*>& rows);
  /// libpng's description of what is wrong.
  const std::string& fault() const;

 private:
  struct Library;
  std::unique_ptr<Library> library_;
};

}  // namespace hapticd::drivers
