// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <expected>
#include <span>
#include <string_view>

#include "rt/vec3.h"

/// The packets of protocol.md as structures, and between these and bytes.
namespace hapticd::drivers::udp {

inline constexpr std::size_t kPlainBytes = 112;
inline constexpr std::size_t kAuthenticatedBytes = 144;  ///< with HMAC-SHA-256 behind
inline constexpr double kMostPositionM = 10;             ///< from the handle's origin
inline constexpr double kMostSpeedMPerS = 100;
inline constexpr double kMostForceN = 1000;
inline constexpr double kMostDampingNSPerM = 1000;

/// Which packet of the receiver the sender has heard last; all zero: none yet.
struct Echo {
  std::uint64_t session = 0;
  std::uint64_t sequence = 0;
  std::uint64_t age_ns = 0;  ///< from its arrival until this packet was made
};

/// What every packet begins with.
struct Header {
  std::uint64_t session = 0;   ///< of the sender, random at its start, never 0
  std::uint64_t sequence = 0;  ///< 1 for the sender's first packet, +1 with each
  std::int64_t time_ns = 0;    ///< when it was made, by the sender's monotonic clock
  Echo echo;
};

/// Bridge to hapticd.
struct StatePacket {
  Header header;
  rt::Vec3 position_m_in_handle;
  rt::Vec3 velocity_m_per_s_in_handle;
  bool velocity_valid = false;
  bool calibrated = false;
  bool fault = false;  ///< the device does not work as it should
  bool damps = false;  ///< the bridge brings in the commands' contact damping
  std::uint32_t buttons = 0;
};

/// hapticd to bridge.
struct CommandPacket {
  Header header;
  rt::Vec3 force_n_in_handle;
  bool active = false;       ///< false: exert nothing, whatever the force says
  std::uint64_t tick = 0;    ///< number of the force tick that computed the force; 0: none
  std::int64_t tick_ns = 0;  ///< when that tick began, by the sender's monotonic clock
  bool may_damp = false;     ///< the sender knows StatePacket::damps; senders that do not have it false
  double contact_damping_n_s_per_m = 0;  ///< for a bridge that damps; 0..kMostDampingNSPerM, sent as binary32
};

/// Why bytes are no packet for this receiver.
enum class Refusal {
  wrong_size,
  not_this_protocol,
  other_version,
  other_kind,
  unknown_flags,
  damaged,
  not_authenticated,          ///< the receiver has a key
  authenticated_without_key,  ///< the receiver has none
  wrong_key,
  impossible_header,  ///< a session or sequence number of 0, or a time out of range
  not_finite,
  out_of_range,
};

/// The refusal for people, after "a packet is refused: ".
std::string_view textOf(Refusal refusal);

/// The bytes of one packet.
class PacketBytes {
 public:
  std::span<const std::byte> bytes() const { return {bytes_.data(), size_}; }

 private:
  friend PacketBytes sealed(std::array<std::byte, kAuthenticatedBytes> bytes, std::span<const std::byte> key);
  std::array<std::byte, kAuthenticatedBytes> bytes_{};
  std::size_t size_ = 0;
};

/// `key`: empty, then the packet is not authenticated.  RT: safe.
PacketBytes encode(const StatePacket& packet, std::span<const std::byte> key);
PacketBytes encode(const CommandPacket& packet, std::span<const std::byte> key);

/// `key`: what the packet must be authenticated with; empty: it must not be.  RT: safe.
std::expected<StatePacket, Refusal> decodeState(std::span<const std::byte> bytes,
                                                std::span<const std::byte> key);
std::expected<CommandPacket, Refusal> decodeCommand(std::span<const std::byte> bytes,
                                                    std::span<const std::byte> key);

/// CRC-32C (Castagnoli, reflected 0x82F63B78).  RT: safe.
std::uint32_t crc32c(std::span<const std::byte> bytes);

}  // namespace hapticd::drivers::udp
