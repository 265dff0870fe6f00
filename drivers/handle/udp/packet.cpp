// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/udp/packet.h"

#include <nettle/hmac.h>
#include <nettle/memops.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "drivers/base/crc32.h"

namespace hapticd::drivers::udp {
namespace {

using rt::Vec3;
using Bytes = std::span<const std::byte>;
using PacketArray = std::array<std::byte, kMaxPacketBytes>;

enum class Kind : std::uint8_t { state = 1, command = 2 };

constexpr std::uint32_t kMagic = 0x43545048;  // "HPTC" in byte order

// Bits of the flags field.
constexpr std::uint16_t kAuthenticated = 1;
constexpr std::uint16_t kVelocityValid = 2;
constexpr std::uint16_t kCalibrated = 4;
constexpr std::uint16_t kFault = 8;
constexpr std::uint16_t kDamps = 16;

// Bits of the offers field of a command.
constexpr std::uint32_t kMayDamp = 1;

// Offsets of the fields.
constexpr std::size_t kMagicAt = 0;
constexpr std::size_t kVersionAt = 4;
constexpr std::size_t kKindAt = 5;
constexpr std::size_t kFlagsAt = 6;
constexpr std::size_t kSessionAt = 8;
constexpr std::size_t kSequenceAt = 16;
constexpr std::size_t kTimeAt = 24;
constexpr std::size_t kEchoSessionAt = 32;
constexpr std::size_t kEchoSequenceAt = 40;
constexpr std::size_t kEchoAgeAt = 48;
constexpr std::size_t kFirstVectorAt = 56;
constexpr std::size_t kSecondVectorAt = 80;
constexpr std::size_t kTickAt = 80;
constexpr std::size_t kTickTimeAt = 88;
constexpr std::size_t kOffersAt = 96;
constexpr std::size_t kDampingAt = 100;
constexpr std::size_t kButtonsOrModeAt = 104;
// From version 2 on.
constexpr std::size_t kMeasuredAt = 108;
constexpr std::size_t kDrivenAt = 110;
constexpr std::size_t kOrientationAt = 112;
constexpr std::size_t kTorqueAt = 112;
constexpr std::size_t kGripperForceAt = 136;
constexpr std::size_t kGripperAt = 144;
constexpr std::size_t kDeviceLatencyAt = 152;
static_assert(kAuthenticationBytes == SHA256_DIGEST_SIZE);

// Bits of what is measured and what is driven besides the force.
constexpr std::uint16_t kOrientation = 1;
constexpr std::uint16_t kGripper = 2;
constexpr std::uint16_t kTorque = 2;
constexpr std::uint16_t kGripperForce = 4;
constexpr std::uint16_t kForce = 1;

/// The checksum ends a packet without authentication.
constexpr std::size_t crcAt(std::uint8_t version) {
  return plainBytesOf(version) - sizeof(std::uint32_t);
}

// Differences of two such numbers cannot overflow.
constexpr std::uint64_t kMaxHeaderNumber = std::uint64_t{1} << 62;

template <typename Number>
void put(PacketArray& bytes, std::size_t at, Number number) {
  for (std::size_t i = 0; i < sizeof number; ++i) bytes[at + i] = static_cast<std::byte>(number >> (8 * i));
}

void put(PacketArray& bytes, std::size_t at, const Vec3& vector) {
  put(bytes, at, std::bit_cast<std::uint64_t>(vector.x));
  put(bytes, at + 8, std::bit_cast<std::uint64_t>(vector.y));
  put(bytes, at + 16, std::bit_cast<std::uint64_t>(vector.z));
}

template <typename Number>
Number get(Bytes bytes, std::size_t at) {
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < sizeof(Number); ++i) {
    number |= std::to_integer<std::uint64_t>(bytes[at + i]) << (8 * i);
  }
  return static_cast<Number>(number);
}

double getNumber(Bytes bytes, std::size_t at) {
  return std::bit_cast<double>(get<std::uint64_t>(bytes, at));
}

Vec3 getVector(Bytes bytes, std::size_t at) {
  return {getNumber(bytes, at), getNumber(bytes, at + 8), getNumber(bytes, at + 16)};
}

void putHeader(PacketArray& bytes, Kind kind, std::uint16_t flags, const Header& header) {
  put(bytes, kMagicAt, kMagic);
  put(bytes, kVersionAt, header.version);
  put(bytes, kKindAt, static_cast<std::uint8_t>(kind));
  put(bytes, kFlagsAt, flags);
  put(bytes, kSessionAt, header.session);
  put(bytes, kSequenceAt, header.sequence);
  put(bytes, kTimeAt, static_cast<std::uint64_t>(header.time_ns));
  put(bytes, kEchoSessionAt, header.echo.session);
  put(bytes, kEchoSequenceAt, header.echo.sequence);
  put(bytes, kEchoAgeAt, header.echo.age_ns);
}

Header getHeader(Bytes bytes) {
  Header header;
  header.version = get<std::uint8_t>(bytes, kVersionAt);
  header.session = get<std::uint64_t>(bytes, kSessionAt);
  header.sequence = get<std::uint64_t>(bytes, kSequenceAt);
  header.time_ns = get<std::int64_t>(bytes, kTimeAt);
  header.echo.session = get<std::uint64_t>(bytes, kEchoSessionAt);
  header.echo.sequence = get<std::uint64_t>(bytes, kEchoSequenceAt);
  header.echo.age_ns = get<std::uint64_t>(bytes, kEchoAgeAt);
  return header;
}

bool isPossible(const Header& header) {
  const bool echoes_nobody = header.echo.session == 0;
  return header.session != 0 && header.sequence != 0 && header.sequence <= kMaxHeaderNumber &&
         header.time_ns >= 0 && static_cast<std::uint64_t>(header.time_ns) <= kMaxHeaderNumber &&
         echoes_nobody == (header.echo.sequence == 0) && header.echo.sequence <= kMaxHeaderNumber &&
         header.echo.age_ns <= kMaxHeaderNumber;
}

std::array<std::byte, SHA256_DIGEST_SIZE> authenticationOf(Bytes bytes, Bytes key) {
  hmac_sha256_ctx context;
  hmac_sha256_set_key(&context, key.size(), reinterpret_cast<const std::uint8_t*>(key.data()));
  hmac_sha256_update(&context, bytes.size(), reinterpret_cast<const std::uint8_t*>(bytes.data()));
  std::array<std::byte, SHA256_DIGEST_SIZE> digest{};
  hmac_sha256_digest(&context, digest.size(), reinterpret_cast<std::uint8_t*>(digest.data()));
  return digest;
}

/// Checks the envelope, cheapest checks first.
std::expected<void, Refusal> checkEnvelope(Bytes bytes, Kind kind, std::uint16_t known_flags, Bytes key) {
  const auto isSizeOf = [&](std::uint8_t version) {
    return bytes.size() == plainBytesOf(version) ||
           bytes.size() == plainBytesOf(version) + kAuthenticationBytes;
  };
  if (!isSizeOf(1) && !isSizeOf(2)) return std::unexpected(Refusal::wrong_size);
  if (get<std::uint32_t>(bytes, kMagicAt) != kMagic) return std::unexpected(Refusal::not_this_protocol);
  const auto version = get<std::uint8_t>(bytes, kVersionAt);
  if (version < kOldestVersion || version > kVersion) return std::unexpected(Refusal::other_version);
  if (!isSizeOf(version)) return std::unexpected(Refusal::wrong_size);
  const std::size_t plain = plainBytesOf(version);
  if (get<std::uint32_t>(bytes, crcAt(version)) != crc32c(bytes.first(crcAt(version))))
    return std::unexpected(Refusal::damaged);
  const auto flags = get<std::uint16_t>(bytes, kFlagsAt);
  const bool authenticated = (flags & kAuthenticated) != 0;
  if (authenticated != (bytes.size() > plain)) return std::unexpected(Refusal::wrong_size);
  if (authenticated && key.empty()) return std::unexpected(Refusal::authenticated_without_key);
  if (!authenticated && !key.empty()) return std::unexpected(Refusal::not_authenticated);
  if (authenticated) {
    const auto expected = authenticationOf(bytes.first(plain), key);
    if (memeql_sec(expected.data(), bytes.data() + plain, expected.size()) == 0)
      return std::unexpected(Refusal::wrong_key);
  }
  if (get<std::uint8_t>(bytes, kKindAt) != static_cast<std::uint8_t>(kind))
    return std::unexpected(Refusal::other_kind);
  if ((flags & ~known_flags) != 0) return std::unexpected(Refusal::unknown_flags);
  if (!isPossible(getHeader(bytes))) return std::unexpected(Refusal::impossible_header);
  return {};
}

std::expected<void, Refusal> checkNumber(double number, double max) {
  if (!std::isfinite(number)) return std::unexpected(Refusal::not_finite);
  if (std::abs(number) > max) return std::unexpected(Refusal::out_of_range);
  return {};
}

std::expected<void, Refusal> checkLength(const Vec3& vector, double max) {
  if (!isFinite(vector)) return std::unexpected(Refusal::not_finite);
  if (norm(vector) > max) return std::unexpected(Refusal::out_of_range);
  return {};
}

void putSecond(PacketArray& bytes, const StatePacket& packet) {
  const int measured =
      (packet.orientation_in_handle ? kOrientation : 0) | (packet.gripper_rad ? kGripper : 0);
  const int driven =
      kForce | (packet.drives_torque ? kTorque : 0) | (packet.drives_gripper ? kGripperForce : 0);
  put(bytes, kMeasuredAt, static_cast<std::uint16_t>(measured));
  put(bytes, kDrivenAt, static_cast<std::uint16_t>(driven));
  const rt::Quaternion q = packet.orientation_in_handle.value_or(rt::Quaternion{});
  put(bytes, kOrientationAt, Vec3{q.x, q.y, q.z});
  put(bytes, kOrientationAt + 24, std::bit_cast<std::uint64_t>(q.w));
  put(bytes, kGripperAt, std::bit_cast<std::uint64_t>(packet.gripper_rad.value_or(0)));
  put(bytes, kDeviceLatencyAt, static_cast<std::uint64_t>(packet.device_latency_ns));
}

std::expected<void, Refusal> getSecond(Bytes bytes, StatePacket& packet) {
  constexpr double kMaxLengthError = 0.01;
  const auto measured = get<std::uint16_t>(bytes, kMeasuredAt);
  const auto driven = get<std::uint16_t>(bytes, kDrivenAt);
  packet.drives_torque = (driven & kTorque) != 0;
  packet.drives_gripper = (driven & kGripperForce) != 0;
  if ((measured & kOrientation) != 0) {
    const Vec3 axis = getVector(bytes, kOrientationAt);
    const rt::Quaternion q{axis.x, axis.y, axis.z, getNumber(bytes, kOrientationAt + 24)};
    if (auto ok = checkNumber(std::sqrt(dot(q, q)) - 1, kMaxLengthError); !ok) return ok;
    packet.orientation_in_handle = rt::normalised(q);
  }
  if ((measured & kGripper) != 0) {
    const double gripper_rad = getNumber(bytes, kGripperAt);
    if (auto ok = checkNumber(gripper_rad, kMaxGripperRad); !ok) return ok;
    packet.gripper_rad = gripper_rad;
  }
  packet.device_latency_ns = get<std::int64_t>(bytes, kDeviceLatencyAt);
  if (packet.device_latency_ns < 0 || packet.device_latency_ns > kMaxDeviceLatencyNs)
    return std::unexpected(Refusal::out_of_range);
  return {};
}

}  // namespace

std::uint32_t crc32c(Bytes bytes) {
  return crc32Of<0x82F63B78>(bytes);
}

PacketBytes sealed(PacketArray bytes, Bytes key) {
  if (!key.empty()) {
    put(bytes, kFlagsAt, static_cast<std::uint16_t>(get<std::uint16_t>(bytes, kFlagsAt) | kAuthenticated));
  }
  const auto version = get<std::uint8_t>(bytes, kVersionAt);
  put(bytes, crcAt(version), crc32c(Bytes(bytes).first(crcAt(version))));
  PacketBytes packet;
  packet.bytes_ = bytes;
  packet.size_ = plainBytesOf(version);
  if (!key.empty()) {
    const auto authentication = authenticationOf(packet.bytes(), key);
    std::ranges::copy(authentication, packet.bytes_.begin() + static_cast<std::ptrdiff_t>(packet.size_));
    packet.size_ += authentication.size();
  }
  return packet;
}

PacketBytes encode(const StatePacket& packet, Bytes key) {
  PacketArray bytes{};
  const int flags = (packet.velocity_valid ? kVelocityValid : 0) | (packet.calibrated ? kCalibrated : 0) |
                    (packet.fault ? kFault : 0) | (packet.damps ? kDamps : 0);
  putHeader(bytes, Kind::state, static_cast<std::uint16_t>(flags), packet.header);
  put(bytes, kFirstVectorAt, packet.position_m_in_handle);
  put(bytes, kSecondVectorAt, packet.velocity_m_per_s_in_handle);
  put(bytes, kButtonsOrModeAt, packet.buttons);
  if (packet.header.version >= 2) putSecond(bytes, packet);
  return sealed(bytes, key);
}

PacketBytes encode(const CommandPacket& packet, Bytes key) {
  PacketArray bytes{};
  putHeader(bytes, Kind::command, 0, packet.header);
  put(bytes, kFirstVectorAt, packet.force_n_in_handle);
  put(bytes, kTickAt, packet.tick);
  put(bytes, kTickTimeAt, static_cast<std::uint64_t>(packet.tick_ns));
  put(bytes, kOffersAt, packet.may_damp ? kMayDamp : std::uint32_t{0});
  put(bytes, kDampingAt, std::bit_cast<std::uint32_t>(static_cast<float>(packet.contact_damping_n_s_per_m)));
  put(bytes, kButtonsOrModeAt, std::uint32_t{packet.active ? 1U : 0U});
  if (packet.header.version >= 2) {
    put(bytes, kTorqueAt, packet.torque_n_m_in_handle);
    put(bytes, kGripperForceAt, std::bit_cast<std::uint64_t>(packet.gripper_force_n));
  }
  return sealed(bytes, key);
}

std::expected<StatePacket, Refusal> decodeState(Bytes bytes, Bytes key) {
  constexpr std::uint16_t kKnownFlags = kAuthenticated | kVelocityValid | kCalibrated | kFault | kDamps;
  if (auto ok = checkEnvelope(bytes, Kind::state, kKnownFlags, key); !ok) return std::unexpected(ok.error());
  const auto flags = get<std::uint16_t>(bytes, kFlagsAt);
  StatePacket packet;
  packet.header = getHeader(bytes);
  packet.position_m_in_handle = getVector(bytes, kFirstVectorAt);
  packet.velocity_m_per_s_in_handle = getVector(bytes, kSecondVectorAt);
  packet.velocity_valid = (flags & kVelocityValid) != 0;
  packet.calibrated = (flags & kCalibrated) != 0;
  packet.fault = (flags & kFault) != 0;
  packet.damps = (flags & kDamps) != 0;
  packet.buttons = get<std::uint32_t>(bytes, kButtonsOrModeAt);
  if (auto ok = checkLength(packet.position_m_in_handle, kMaxPositionM); !ok)
    return std::unexpected(ok.error());
  if (auto ok = checkLength(packet.velocity_m_per_s_in_handle, kMaxSpeedMPerS); !ok)
    return std::unexpected(ok.error());
  if (packet.header.version >= 2) {
    if (auto ok = getSecond(bytes, packet); !ok) return std::unexpected(ok.error());
  }
  return packet;
}

std::expected<CommandPacket, Refusal> decodeCommand(Bytes bytes, Bytes key) {
  if (auto ok = checkEnvelope(bytes, Kind::command, kAuthenticated, key); !ok)
    return std::unexpected(ok.error());
  CommandPacket packet;
  packet.header = getHeader(bytes);
  packet.force_n_in_handle = getVector(bytes, kFirstVectorAt);
  const auto mode = get<std::uint32_t>(bytes, kButtonsOrModeAt);
  if (mode > 1) return std::unexpected(Refusal::out_of_range);
  packet.active = mode == 1;
  packet.tick = get<std::uint64_t>(bytes, kTickAt);
  packet.tick_ns = get<std::int64_t>(bytes, kTickTimeAt);
  packet.may_damp = (get<std::uint32_t>(bytes, kOffersAt) & kMayDamp) != 0;
  packet.contact_damping_n_s_per_m = double{std::bit_cast<float>(get<std::uint32_t>(bytes, kDampingAt))};
  if (auto ok = checkLength(packet.force_n_in_handle, kMaxForceN); !ok) return std::unexpected(ok.error());
  if (!std::isfinite(packet.contact_damping_n_s_per_m)) return std::unexpected(Refusal::not_finite);
  if (packet.contact_damping_n_s_per_m < 0 || packet.contact_damping_n_s_per_m > kMaxDampingNSPerM)
    return std::unexpected(Refusal::out_of_range);
  if (packet.header.version >= 2) {
    packet.torque_n_m_in_handle = getVector(bytes, kTorqueAt);
    packet.gripper_force_n = getNumber(bytes, kGripperForceAt);
    if (auto ok = checkLength(packet.torque_n_m_in_handle, kMaxTorqueNM); !ok)
      return std::unexpected(ok.error());
    if (auto ok = checkNumber(packet.gripper_force_n, kMaxForceN); !ok) return std::unexpected(ok.error());
  }
  return packet;
}

std::string_view textOf(Refusal refusal) {
  switch (refusal) {
    case Refusal::wrong_size:
      return "wrong size (is another program sending there?)";
    case Refusal::not_this_protocol:
      return "another protocol (is another program sending there?)";
    case Refusal::other_version:
      return "another version of the protocol (bring both sides to the same version)";
    case Refusal::other_kind:
      return "of the wrong direction (is our own packet reflected?)";
    case Refusal::unknown_flags:
      return "unknown flags (bring both sides to the same version)";
    case Refusal::damaged:
      return "damaged in transit (check cables and network cards)";
    case Refusal::not_authenticated:
      return "not authenticated (give the peer the key as well)";
    case Refusal::authenticated_without_key:
      return "authenticated, but no key is configured here (set udp_handle.key_file)";
    case Refusal::wrong_key:
      return "another key, or forged (give both sides the same key)";
    case Refusal::impossible_header:
      return "an impossible session, number or time (the sender does not follow the protocol)";
    case Refusal::not_finite:
      return "a value that is not finite (does the device work correctly?)";
    case Refusal::out_of_range:
      return "a value out of range (the units are metres, metres per second, newtons and newton metres; "
             "quaternions have length 1)";
  }
  return "";
}

}  // namespace hapticd::drivers::udp
