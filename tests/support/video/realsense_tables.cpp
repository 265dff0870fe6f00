// SPDX-License-Identifier: Apache-2.0
#include "tests/support/video/realsense_tables.h"

#include <algorithm>

namespace hapticd::test {

std::uint32_t bitwiseCrc(const std::vector<std::byte>& bytes, std::size_t first) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (std::size_t i = first; i < bytes.size(); ++i) {
    crc ^= std::to_integer<std::uint32_t>(bytes[i]);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0xEDB88320 : 0);
  }
  return ~crc;
}

void seal(std::vector<std::byte>& table) {
  put(table, 12, bitwiseCrc(table, 16));
}

std::vector<std::byte> coefficientsTable() {
  std::vector<std::byte> table(576);
  put(table, 2, std::uint16_t{25});
  put(table, 4, std::uint32_t{560});
  put(table, 160, -50.0F);
  for (std::size_t size = 0; size < 16; ++size) {
    const std::size_t offset = 256 + 16 * size;
    put(table, offset, 960.0F);
    put(table, offset + 4, 960.0F);
    put(table, offset + 8, 959.5F);
    put(table, offset + 12, 539.5F);
  }
  put(table, 256 + 48, 425.0F);
  put(table, 256 + 52, 425.0F);
  put(table, 256 + 56, 420.0F);
  put(table, 256 + 60, 238.0F);
  put(table, 256 + 80, 212.5F);  // 424 x 240
  put(table, 256 + 84, 212.5F);
  put(table, 256 + 88, 210.0F);
  put(table, 256 + 92, 119.0F);
  seal(table);
  return table;
}

std::vector<std::byte> depthModes() {
  std::vector<std::byte> modes(40);
  put(modes, 0, std::uint16_t{1280});
  put(modes, 2, std::uint16_t{720});
  put(modes, 4, 640.0F);
  put(modes, 8, 640.0F);
  put(modes, 12, 640.0F);
  put(modes, 16, 360.0F);
  put(modes, 20, std::uint16_t{848});
  put(modes, 22, std::uint16_t{480});
  put(modes, 24, 424.0F);
  put(modes, 28, 424.0F);
  put(modes, 32, 422.0F);
  put(modes, 36, 239.0F);
  return modes;
}

std::vector<std::byte> deviceData() {
  std::vector<std::byte> data(256);
  put(data, 12, std::uint32_t{0x050F0100});
  for (std::size_t i = 0; i < 6; ++i) {
    data[48 + i] = static_cast<std::byte>("\x01\x23\x45\xab\xcd\xef"[i]);
  }
  return data;
}

std::vector<std::byte> monitorReply(std::uint32_t command, const std::vector<std::byte>& data) {
  std::vector<std::byte> reply(1024);
  put(reply, 0, command);
  std::ranges::copy(data, reply.begin() + 4);
  put(reply, 1020, static_cast<std::uint32_t>(data.size()));
  return reply;
}

}  // namespace hapticd::test
