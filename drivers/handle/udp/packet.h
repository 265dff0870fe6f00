// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <expected>
#include <optional>
#include <span>
#include <string_view>

#include "rt/base/rigid_pose.h"
#include "rt/base/vec3.h"

/// The packets of protocol.md as structures, and their encoding.
namespace hapticd::drivers::udp {

inline constexpr std::uint8_t kOldestVersion = 1;
inline constexpr std::uint8_t kVersion = 2;  ///< newest: orientation, gripper and torque travel as well
inline constexpr std::size_t kAuthenticationBytes = 32;  ///< of the HMAC-SHA-256, behind a packet
/// Size of a packet that is not authenticated. `version`: kOldestVersion..kVersion.
constexpr std::size_t plainBytesOf(std::uint8_t version) {
  return version == 1 ? 112 : 168;
}
inline constexpr std::size_t kMaxPacketBytes = plainBytesOf(kVersion) + kAuthenticationBytes;
inline constexpr double kMaxPositionM = 10;  ///< from the handle's origin
inline constexpr double kMaxSpeedMPerS = 100;
inline constexpr double kMaxForceN = 1000;
inline constexpr double kMaxDampingNSPerM = 1000;
inline constexpr double kMaxTorqueNM = 100;
inline constexpr double kMaxGripperRad = 7;
inline constexpr std::int64_t kMaxDeviceLatencyNs = 1'000'000'000;

/// The packet of the receiver that the sender received last; all zero: none yet.
struct Echo {
  std::uint64_t session = 0;
  std::uint64_t sequence = 0;
  std::uint64_t age_ns = 0;  ///< time from its arrival until this packet was made
};

/// Common beginning of all packets.
struct Header {
  std::uint64_t session = 0;   ///< of the sender, random at its start, never 0
  std::uint64_t sequence = 0;  ///< 1 for the sender's first packet, incremented with each
  std::int64_t time_ns = 0;    ///< when the packet was made, by the sender's monotonic clock
  Echo echo;
  std::uint8_t version = kVersion;  ///< of the packet that it begins
};

/// Packet from the bridge to hapticd.
struct StatePacket {
  Header header;
  rt::Vec3 position_m_in_handle;
  rt::Vec3 velocity_m_per_s_in_handle;
  bool velocity_valid = false;
  bool calibrated = false;
  bool fault = false;  ///< the device has a fault
  bool damps = false;  ///< the bridge applies the contact damping of the commands
  std::uint32_t buttons = 0;
  // From version 2 on; in a packet of version 1 as they are here.
  std::optional<rt::Quaternion> orientation_in_handle = {};  ///< unit; maps vectors of the tool to the handle
  std::optional<double> gripper_rad = {};                    ///< opening angle; 0: closed
  bool drives_torque = false;                                ///< the device exerts torques
  bool drives_gripper = false;                               ///< the device exerts forces on a gripper
  std::int64_t device_latency_ns = 0;  ///< what the device adds to the delay beyond the bridge's loop
};

/// Packet from hapticd to the bridge.
struct CommandPacket {
  Header header;
  rt::Vec3 force_n_in_handle;
  bool active = false;                   ///< false: exert no force, whatever force_n_in_handle is
  std::uint64_t tick = 0;                ///< number of the force tick that computed the force; 0: none
  std::int64_t tick_ns = 0;              ///< when that tick began, by the sender's monotonic clock
  bool may_damp = false;                 ///< the sender supports StatePacket::damps; false for older senders
  double contact_damping_n_s_per_m = 0;  ///< for a bridge that damps; 0..kMaxDampingNSPerM, sent as binary32
  // From version 2 on; in a packet of version 1 as they are here.
  rt::Vec3 torque_n_m_in_handle = {};
  double gripper_force_n = 0;  ///< > 0 opens
};

/// Reasons to reject received bytes.
enum class Refusal {
  wrong_size,
  not_this_protocol,
  other_version,
  other_kind,
  unknown_flags,
  damaged,
  not_authenticated,          ///< but the receiver has a key
  authenticated_without_key,  ///< but the receiver has no key
  wrong_key,
  impossible_header,  ///< a session or sequence number of 0, or a time out of range
  not_finite,
  out_of_range,
};

/// Returns a description for people, to follow "a packet was rejected: ".
std::string_view textOf(Refusal refusal);

/// The encoded bytes of one packet.
class PacketBytes {
 public:
  std::span<const std::byte> bytes() const { return {bytes_.data(), size_}; }

 private:
  friend PacketBytes sealed(std::array<std::byte, kMaxPacketBytes> bytes, std::span<const std::byte> key);
  std::array<std::byte, kMaxPacketBytes> bytes_{};
  std::size_t size_ = 0;
};

/// Encodes a packet in the version of its header. `key`: empty: without authentication.  RT: safe.
PacketBytes encode(const StatePacket& packet, std::span<const std::byte> key);
PacketBytes encode(const CommandPacket& packet, std::span<const std::byte> key);

/// Decodes and checks a packet. `key`: key for authentication; empty: the packet must not be authenticated.
/// RT: safe.
std::expected<StatePacket, Refusal> decodeState(std::span<const std::byte> bytes,
                                                std::span<const std::byte> key);
std::expected<CommandPacket, Refusal> decodeCommand(std::span<const std::byte> bytes,
                                                    std::span<const std::byte> key);

/// Computes the CRC-32C (Castagnoli, reflected polynomial 0x82F63B78).  RT: safe.
std::uint32_t crc32c(std::span<const std::byte> bytes);

}  // namespace hapticd::drivers::udp
