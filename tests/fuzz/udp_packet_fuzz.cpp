// SPDX-License-Identifier: Apache-2.0
// Data arriving at the UDP port: decoding, and the conversation for valid packets.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <span>
#include <vector>

#include "drivers/handle/udp/conversation.h"
#include "drivers/handle/udp/packet.h"

namespace {

namespace udp = hapticd::drivers::udp;

void require(bool holds) {
  if (!holds) std::abort();
}

/// Most inputs would fail at the CRC: the same bytes with a correct one.
std::vector<std::byte> withRightCrc(std::span<const std::byte> bytes) {
  constexpr std::size_t kCrcAt = 108;
  std::vector<std::byte> packet(bytes.begin(), bytes.end());
  if (packet.size() < udp::kPlainBytes) return packet;
  const std::uint32_t crc = udp::crc32c(std::span(packet).first(kCrcAt));
  for (std::size_t i = 0; i < sizeof crc; ++i) packet[kCrcAt + i] = static_cast<std::byte>(crc >> (8 * i));
  return packet;
}

void take(std::span<const std::byte> bytes, std::span<const std::byte> key) {
  static udp::Conversation conversation(1);
  static std::int64_t now_ns = 0;
  if (const auto state = udp::decodeState(bytes, key)) {
    require(norm(state->position_m_in_handle) <= udp::kMaxPositionM);
    require(norm(state->velocity_m_per_s_in_handle) <= udp::kMaxSpeedMPerS);
    now_ns += 1'000'000;
    conversation.answerTo(state->header, now_ns);
    conversation.hear(state->header, now_ns);
    conversation.next(now_ns);
    require(conversation.loopNs() >= 0 && conversation.loopNs() <= udp::kFreshNs);
  }
  if (const auto command = udp::decodeCommand(bytes, key)) {
    require(norm(command->force_n_in_handle) <= udp::kMaxForceN);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::vector<std::byte> key(16, std::byte{'k'});
  const std::span<const std::byte> bytes = std::as_bytes(std::span(data, size));
  take(bytes, {});
  take(bytes, key);
  take(withRightCrc(bytes), {});
  return 0;
}
