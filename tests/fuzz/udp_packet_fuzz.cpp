// SPDX-License-Identifier: Apache-2.0
// Data arriving at the UDP port: decoding, and the conversation for valid packets.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "drivers/handle/udp/conversation.h"
#include "drivers/handle/udp/packet.h"
#include "tests/fuzz/seeds.h"

namespace {

namespace udp = hapticd::drivers::udp;

constexpr std::uint64_t kSession = 1;  // of the receiver
const std::vector<std::byte> kKey(16, std::byte{'k'});

/// Most inputs would fail at the CRC: the same bytes with a correct one.
std::vector<std::byte> withRightCrc(std::span<const std::byte> bytes) {
  constexpr std::size_t kVersionAt = 4;
  std::vector<std::byte> packet(bytes.begin(), bytes.end());
  if (packet.size() < udp::plainBytesOf(1)) return packet;
  const std::size_t crc_at = udp::plainBytesOf(packet[kVersionAt] == std::byte{1} ? 1 : 2) - 4;
  if (packet.size() < crc_at + 4) return packet;
  const std::uint32_t crc = udp::crc32c(std::span(packet).first(crc_at));
  for (std::size_t i = 0; i < sizeof crc; ++i) packet[crc_at + i] = static_cast<std::byte>(crc >> (8 * i));
  return packet;
}

void take(std::span<const std::byte> bytes, std::span<const std::byte> key) {
  static udp::Conversation conversation(kSession);
  static std::int64_t now_ns = 0;
  if (const auto state = udp::decodeState(bytes, key)) {
    require(norm(state->position_m_in_handle) <= udp::kMaxPositionM);
    require(norm(state->velocity_m_per_s_in_handle) <= udp::kMaxSpeedMPerS);
    if (const auto& q = state->orientation_in_handle) require(std::abs(dot(*q, *q) - 1) < 1e-9);
    require(std::abs(state->gripper_rad.value_or(0)) <= udp::kMaxGripperRad);
    now_ns += 1'000'000;
    conversation.answerTo(state->header, now_ns);
    conversation.hear(state->header, now_ns);
    conversation.next(now_ns);
    require(conversation.loopNs() >= 0 && conversation.loopNs() <= udp::kFreshNs);
  }
  if (const auto command = udp::decodeCommand(bytes, key)) {
    require(norm(command->force_n_in_handle) <= udp::kMaxForceN);
    require(norm(command->torque_n_m_in_handle) <= udp::kMaxTorqueNM);
  }
}

template <typename Packet>
std::string encoded(const Packet& packet, std::span<const std::byte> key = {}) {
  const udp::PacketBytes packed = udp::encode(packet, key);
  return {reinterpret_cast<const char*>(packed.bytes().data()), packed.bytes().size()};
}

/// A state of a sender that heard packet `echo` of the receiver `age_ns` ago; 0: it has heard none.
udp::StatePacket stateOf(std::uint64_t sequence, std::uint64_t echo, std::uint64_t age_ns = 100'000) {
  udp::StatePacket state;
  state.header = {.session = 7, .sequence = sequence, .time_ns = 1'000'000'000, .echo = {}};
  if (echo > 0) state.header.echo = {.session = kSession, .sequence = echo, .age_ns = age_ns};
  state.position_m_in_handle = {0.01, -0.02, 0.3};
  state.velocity_m_per_s_in_handle = {0.1, 0, -0.1};
  state.velocity_valid = state.calibrated = state.damps = true;
  state.buttons = 3;
  return state;
}

}  // namespace

std::vector<std::string> seeds() {
  std::vector<std::string> all;
  all.push_back(encoded(stateOf(1, 0)));  // a greeting
  for (const std::uint64_t sequence : {2U, 3U, 3U, 9U, 8U, 200U, 100U}) {
    all.push_back(encoded(stateOf(sequence, 1)));  // in order, again, with a gap, late, beyond the window
  }
  all.push_back(encoded(stateOf(201, 1, 50'000'000)));  // an echo from long ago, and one of the future
  all.push_back(encoded(stateOf(202, 1'000'000)));
  all.push_back(encoded(stateOf(203, 2), kKey));
  udp::StatePacket state = stateOf(204, 2);
  state.header.echo.session = 5;  // of an earlier receiver
  all.push_back(encoded(state));
  state.header.session = 8;  // the sender started again
  all.push_back(encoded(state));
  state.header.session = 0;
  all.push_back(encoded(state));
  state = stateOf(205, 2);
  state.fault = true;
  state.header.time_ns = std::numeric_limits<std::int64_t>::max();
  all.push_back(encoded(state));
  state = stateOf(206, 2);
  state.position_m_in_handle.x = std::nan("");
  all.push_back(encoded(state));
  state.position_m_in_handle = {udp::kMaxPositionM, 1, 0};
  all.push_back(encoded(state));
  state = stateOf(207, 2);
  state.velocity_m_per_s_in_handle.z = udp::kMaxSpeedMPerS;
  all.push_back(encoded(state));
  state = stateOf(208, 2);
  state.orientation_in_handle = {0.5, -0.5, 0.5, 0.5};
  state.gripper_rad = 0.2;
  state.drives_torque = state.drives_gripper = true;
  state.device_latency_ns = 1'000'000;
  all.push_back(encoded(state));
  all.push_back(encoded(state, kKey));
  state.orientation_in_handle->w = 2;
  all.push_back(encoded(state));
  state.header.version = 1;
  all.push_back(encoded(state));

  udp::CommandPacket command;
  command.header = stateOf(1, 1).header;
  all.push_back(encoded(command));
  command.force_n_in_handle = {1, -2, 3};
  command.active = command.may_damp = true;
  command.tick = 42;
  command.tick_ns = 1'000'000;
  command.contact_damping_n_s_per_m = 2.5;
  all.push_back(encoded(command));
  all.push_back(encoded(command, kKey));
  command.torque_n_m_in_handle = {0.1, 0, -udp::kMaxTorqueNM};
  all.push_back(encoded(command));
  command.force_n_in_handle.y = 2 * udp::kMaxForceN;
  all.push_back(encoded(command));
  command.force_n_in_handle.y = 0;
  command.contact_damping_n_s_per_m = std::numeric_limits<double>::infinity();
  all.push_back(encoded(command));
  all.push_back(all.front().substr(0, all.front().size() - 1));
  all.push_back(all.front() + std::string(udp::kAuthenticationBytes, '\0'));
  return all;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::byte> bytes = std::as_bytes(std::span(data, size));
  take(bytes, {});
  take(bytes, kKey);
  take(withRightCrc(bytes), {});
  return 0;
}
