// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/base64.h"

#include <algorithm>
#include <cstddef>
#include <string_view>

namespace hapticd::daemon {

std::string base64(std::span<const std::uint8_t> bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t begin = 0; begin < bytes.size(); begin += 3) {
    const std::size_t held = std::min<std::size_t>(3, bytes.size() - begin);
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < 3; ++i) bits = bits << 8 | (i < held ? bytes[begin + i] : 0U);
    for (std::size_t digit = 0; digit < 4; ++digit) {
      text += digit <= held ? kDigits[bits >> (18 - 6 * digit) & 63U] : '=';
    }
  }
  return text;
}

}  // namespace hapticd::daemon
