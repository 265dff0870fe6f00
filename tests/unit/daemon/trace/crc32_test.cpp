// SPDX-License-Identifier: Apache-2.0
#include "drivers/base/crc32.h"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <string_view>

namespace hapticd::trace {
namespace {

constexpr std::uint32_t kIeee = 0xEDB88320, kCastagnoli = 0x82F63B78;

template <std::uint32_t kPolynomial>
std::uint32_t crcOf(std::string_view text, std::uint32_t before = 0) {
  return drivers::crc32Of<kPolynomial>(std::as_bytes(std::span(text)), before);
}

/// Bit by bit, following the definition as polynomial division.
std::uint32_t divided(std::string_view text, std::uint32_t polynomial) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (const char c : text) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) != 0 ? polynomial : 0);
  }
  return ~crc;
}

TEST(Crc32, IsThatOfTheStandardsForTheirCheckText) {
  EXPECT_EQ(crcOf<kIeee>("123456789"), 0xCBF43926U);        // IEEE 802.3
  EXPECT_EQ(crcOf<kCastagnoli>("123456789"), 0xE3069283U);  // RFC 3720
  EXPECT_EQ(crcOf<kIeee>(""), 0U);
}

TEST(Crc32, IsTheRemainderForEveryLengthAndFromPieces) {
  std::mt19937 random(1);
  std::string text;
  for (std::size_t length = 0; length < 70; ++length) {
    EXPECT_EQ(crcOf<kIeee>(text), divided(text, kIeee)) << length;
    EXPECT_EQ(crcOf<kCastagnoli>(text), divided(text, kCastagnoli)) << length;
    const std::size_t cut = length / 3;
    const std::string_view all = text;
    EXPECT_EQ(crcOf<kIeee>(all.substr(cut), crcOf<kIeee>(all.substr(0, cut))), crcOf<kIeee>(all)) << length;
    text.push_back(static_cast<char>(random()));
  }
}

}  // namespace
}  // namespace hapticd::trace
