// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/tests/kinect_rig.h"

#include "tests/support/made_up_pixel.h"

namespace hapticd::test {

std::vector<std::uint16_t> unpack(const Bytes& packed) {
  std::vector<std::uint16_t> raw(640 * 480);
  for (std::size_t bit = 0; bit < raw.size() * 11; ++bit) {
    const unsigned value = unsigned{packed.at(bit / 8)} >> (7 - bit % 8) & 1U;
    raw[bit / 11] = static_cast<std::uint16_t>(unsigned{raw[bit / 11]} << 1 | value);
  }
  return raw;
}

std::vector<std::uint16_t> madeUpImage(std::uint32_t frame) {
  std::vector<std::uint16_t> raw(640 * 480);
  for (std::size_t pixel = 0; pixel < raw.size(); ++pixel) raw[pixel] = madeUpPixel(frame, pixel);
  return raw;
}

Bytes block(std::uint16_t command, std::uint16_t tag, const std::vector<std::uint16_t>& words) {
  Bytes bytes{'G', 'M'};
  const auto add = [&bytes](std::size_t word) {
    bytes.push_back(static_cast<std::uint8_t>(word & 0xff));
    bytes.push_back(static_cast<std::uint8_t>(word >> 8));
  };
  add(words.size());
  add(command);
  add(tag);
  for (const std::uint16_t word : words) add(word);
  return bytes;
}

}  // namespace hapticd::test
