// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <nettle/sha2.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "rt/base/vec3.h"

/// The peer of the UDP handle, implemented from protocol.md only: it shares no code with the driver.
namespace hapticd::test {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they are");

using Bytes = std::vector<std::uint8_t>;

template <typename Number>
void putAt(Bytes& bytes, std::size_t at, Number number) {
  std::memcpy(bytes.data() + at, &number, sizeof number);
}

template <typename Number>
Number getAt(const Bytes& bytes, std::size_t at) {
  Number number{};
  std::memcpy(&number, bytes.data() + at, sizeof number);
  return number;
}

/// Computes the CRC-32C bit by bit.
inline std::uint32_t slowCrc32c(const std::uint8_t* bytes, std::size_t size) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (std::size_t i = 0; i < size; ++i) {
    crc ^= bytes[i];
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1) != 0 ? (crc >> 1) ^ 0x82F63B78 : crc >> 1;
  }
  return crc ^ 0xFFFFFFFF;
}

/// Computes the HMAC of RFC 2104 with SHA-256, for keys of at most 64 bytes.
inline std::array<std::uint8_t, 32> slowHmac(const std::string& key, const std::uint8_t* bytes,
                                             std::size_t size) {
  std::array<std::uint8_t, 64> inner{};
  std::array<std::uint8_t, 64> outer{};
  std::copy(key.begin(), key.end(), inner.begin());
  outer = inner;
  for (auto& byte : inner) byte ^= 0x36;
  for (auto& byte : outer) byte ^= 0x5c;
  std::array<std::uint8_t, 32> digest{};
  sha256_ctx context;
  sha256_init(&context);
  sha256_update(&context, inner.size(), inner.data());
  sha256_update(&context, size, bytes);
  sha256_digest(&context, digest.size(), digest.data());
  sha256_update(&context, outer.size(), outer.data());
  sha256_update(&context, digest.size(), digest.data());
  sha256_digest(&context, digest.size(), digest.data());
  return digest;
}

/// Computes the CRC, and with a key the flag and the HMAC, over the packet's content.
inline Bytes sealedAgain(Bytes bytes, const std::string& key = {}) {
  const std::size_t plain = bytes[4] == 2 ? 168 : 112;
  bytes.resize(plain);
  const auto flags = static_cast<std::uint16_t>(getAt<std::uint16_t>(bytes, 6) & ~1U);
  putAt(bytes, 6, static_cast<std::uint16_t>(flags | (key.empty() ? 0U : 1U)));
  putAt(bytes, plain - 4, slowCrc32c(bytes.data(), plain - 4));
  if (key.empty()) return bytes;
  const auto digest = slowHmac(key, bytes.data(), bytes.size());
  bytes.insert(bytes.end(), digest.begin(), digest.end());
  return bytes;
}

/// Content of a state; the flags are as in protocol.md.
struct RawState {
  std::uint64_t session = 0;
  std::uint64_t sequence = 0;
  std::int64_t time_ns = 0;
  std::uint64_t echo_session = 0;
  std::uint64_t echo_sequence = 0;
  std::uint64_t echo_age_ns = 0;
  rt::Vec3 position_m;
  rt::Vec3 velocity_m_per_s;
  std::uint32_t buttons = 0;
  std::uint16_t flags = 2 | 4;  // velocity valid, calibrated
  std::uint8_t version = 1;
  // From version 2 on.
  std::uint16_t measured = 0;
  std::uint16_t driven = 0;
  std::array<double, 4> orientation{};
  double gripper_rad = 0;
  std::uint64_t latency_ns = 0;
};

inline Bytes bytesOf(const RawState& state, const std::string& key = {}) {
  Bytes bytes(state.version == 2 ? 168 : 112);
  std::memcpy(bytes.data(), "HPTC", 4);
  bytes[4] = state.version;
  bytes[5] = 1;
  putAt(bytes, 6, state.flags);
  putAt(bytes, 8, state.session);
  putAt(bytes, 16, state.sequence);
  putAt(bytes, 24, state.time_ns);
  putAt(bytes, 32, state.echo_session);
  putAt(bytes, 40, state.echo_sequence);
  putAt(bytes, 48, state.echo_age_ns);
  const std::array<double, 6> numbers{state.position_m.x,       state.position_m.y,
                                      state.position_m.z,       state.velocity_m_per_s.x,
                                      state.velocity_m_per_s.y, state.velocity_m_per_s.z};
  std::memcpy(bytes.data() + 56, numbers.data(), sizeof numbers);
  putAt(bytes, 104, state.buttons);
  if (state.version == 2) {
    putAt(bytes, 108, state.measured);
    putAt(bytes, 110, state.driven);
    std::memcpy(bytes.data() + 112, state.orientation.data(), sizeof state.orientation);
    putAt(bytes, 144, state.gripper_rad);
    putAt(bytes, 152, state.latency_ns);
  }
  return sealedAgain(bytes, key);
}

/// Content of a command.
struct RawCommand {
  std::uint64_t session = 0;
  std::uint64_t sequence = 0;
  std::uint64_t echo_session = 0;
  std::uint64_t echo_sequence = 0;
  rt::Vec3 force_n;
  std::uint32_t mode = 0;
};

inline RawCommand commandIn(const Bytes& bytes) {
  return {getAt<std::uint64_t>(bytes, 8),
          getAt<std::uint64_t>(bytes, 16),
          getAt<std::uint64_t>(bytes, 32),
          getAt<std::uint64_t>(bytes, 40),
          {getAt<double>(bytes, 56), getAt<double>(bytes, 64), getAt<double>(bytes, 72)},
          getAt<std::uint32_t>(bytes, 104)};
}

/// Returns an address of this computer's loopback network that no other test uses: `host` within this
/// process's own range.
inline std::string ownLoopback(int host) {
  const int pid = ::getpid();
  return "127." + std::to_string(64 + (pid >> 14) % 128) + "." + std::to_string((pid >> 6) & 255) + "." +
         std::to_string(((pid & 63) << 2) + host);
}

/// A UDP socket of a test.
class TestSocket {
 public:
  TestSocket(const std::string& address, std::uint16_t port)
      : descriptor_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    const sockaddr_in local = addressOf(address, port);
    if (::bind(descriptor_, reinterpret_cast<const sockaddr*>(&local), sizeof local) != 0) {
      ::close(descriptor_);
      throw std::runtime_error("cannot bind " + address);
    }
  }
  ~TestSocket() { ::close(descriptor_); }
  TestSocket(const TestSocket&) = delete;
  TestSocket& operator=(const TestSocket&) = delete;

  void send(const Bytes& bytes, const std::string& address, std::uint16_t port) const {
    const sockaddr_in to = addressOf(address, port);
    if (::sendto(descriptor_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to),
                 sizeof to) < 0) {
      throw std::runtime_error("cannot send");
    }
  }

  /// Returns what arrives within `wait_ms`.
  std::optional<Bytes> receive(int wait_ms) const {
    pollfd watched{descriptor_, POLLIN, 0};
    if (::poll(&watched, 1, wait_ms) <= 0) return std::nullopt;
    Bytes bytes(256);
    const ssize_t size = ::recv(descriptor_, bytes.data(), bytes.size(), 0);
    if (size < 0) return std::nullopt;
    bytes.resize(static_cast<std::size_t>(size));
    return bytes;
  }

 private:
  static sockaddr_in addressOf(const std::string& address, std::uint16_t port) {
    sockaddr_in result{};
    result.sin_family = AF_INET;
    result.sin_port = htons(port);
    ::inet_pton(AF_INET, address.c_str(), &result.sin_addr);
    return result;
  }

  int descriptor_;
};

}  // namespace hapticd::test
