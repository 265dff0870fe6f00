// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/phantom_omni/packets.h"

#include <algorithm>

namespace hapticd::tools::phantom_omni {
namespace {

// All fields are little-endian.
constexpr std::uint16_t kHeader = 0x0000;
constexpr std::uint16_t kSecondHeader = 0x001e;
constexpr std::size_t kEncodersAt = 4;
constexpr std::size_t kSwitchesAt = 19;  // zero: pressed, docked
constexpr std::size_t kCounterAt = 32;
constexpr int kButtons = 2;
constexpr unsigned int kUndocked = 1U << 2;

constexpr std::size_t kBitsAt = 6;
constexpr int kNoTorque = 0x7ff;
constexpr std::uint16_t kBaseBits = 0x53c0;  // everything off; the meaning of most is not known
constexpr std::uint16_t kMotorsOn = 1U << 3;

std::uint16_t wordAt(std::span<const unsigned char> bytes, std::size_t at) {
  return static_cast<std::uint16_t>(bytes[at] | bytes[at + 1] << 8);
}

}  // namespace

std::optional<OmniReading> readingIn(std::span<const unsigned char> bytes) {
  if (bytes.size() < kReadingBytes) return std::nullopt;
  if (wordAt(bytes, 0) != kHeader || wordAt(bytes, 2) != kSecondHeader) return std::nullopt;
  OmniReading reading;
  for (std::size_t joint = 0; joint < reading.encoders.size(); ++joint)
    reading.encoders[joint] = static_cast<std::int16_t>(wordAt(bytes, kEncodersAt + 2 * joint));
  const unsigned int switches = bytes[kSwitchesAt];
  reading.buttons = ~switches & ((1U << kButtons) - 1);
  reading.docked = (switches & kUndocked) == 0;
  reading.counter = wordAt(bytes, kCounterAt) | std::uint32_t{wordAt(bytes, kCounterAt + 2)} << 16;
  return reading;
}

std::array<unsigned char, kCommandBytes> bytesOf(const OmniCommand& command) {
  std::array<unsigned char, kCommandBytes> bytes{};
  const auto write = [&bytes](std::size_t at, unsigned int word) {
    bytes[at] = static_cast<unsigned char>(word);
    bytes[at + 1] = static_cast<unsigned char>(word >> 8);
  };
  for (std::size_t joint = 0; joint < command.counts.size(); ++joint) {
    const int counts = command.motors_on ? std::clamp(command.counts[joint], -kMostCounts, kMostCounts) : 0;
    write(2 * joint, static_cast<unsigned int>(kNoTorque + counts));
  }
  write(kBitsAt, kBaseBits | static_cast<unsigned int>(command.light) | (command.motors_on ? kMotorsOn : 0U));
  return bytes;
}

}  // namespace hapticd::tools::phantom_omni
