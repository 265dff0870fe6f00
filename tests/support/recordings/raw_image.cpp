// SPDX-License-Identifier: Apache-2.0
#include "tests/support/recordings/raw_image.h"

#include <fstream>
#include <stdexcept>

namespace hapticd::test {

std::vector<std::uint16_t> rawPixelsOf(const std::filesystem::path& file) {
  constexpr std::size_t kPixels = 640 * 480;
  std::ifstream stream(file, std::ios::binary);
  std::string header;
  std::getline(stream, header);
  std::vector<unsigned char> bytes(2 * kPixels);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!stream) throw std::runtime_error("cannot read " + file.string());
  std::vector<std::uint16_t> raw(kPixels);
  for (std::size_t pixel = 0; pixel < raw.size(); ++pixel) {
    raw[pixel] = static_cast<std::uint16_t>(bytes[2 * pixel] + 256 * bytes[2 * pixel + 1]);
  }
  return raw;
}

}  // namespace hapticd::test
