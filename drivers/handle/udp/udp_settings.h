// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"
#include "config/settings/driver_rows.h"
#include "config/settings/row_of_member.h"

namespace hapticd::drivers {

/// An IPv4 address with a UDP port, both in host byte order.
struct Ipv4Endpoint {
  std::uint32_t address = 0;  ///< 0: any address of this computer
  std::uint16_t port = 0;     ///< 0: not specified

  bool operator==(const Ipv4Endpoint&) const = default;
};

/// Parses "A.B.C.D" or "A.B.C.D:PORT" with PORT in 1..65535.
/// Errors (without a place): anything else; names are not resolved.
base::Result<Ipv4Endpoint> ipv4EndpointFrom(std::string_view text);

/// Returns whether the address is in 127.0.0.0/8, which is reachable only from this computer.
constexpr bool isLoopback(const Ipv4Endpoint& endpoint) {
  return endpoint.address >> 24 == 127;
}

/// Returns e.g. "192.0.2.10:47800", or only the address if no port is specified.
std::string textOf(const Ipv4Endpoint& endpoint);

/// A device on another computer, connected by the packets of drivers/handle/udp/protocol.md.
struct UdpHandleSettings {
  std::string address = "127.0.0.1";  ///< of this computer, where packets of the peer arrive
  int port = 47800;
  std::string peer;  ///< address of the other computer; "address:port" accepts packets from that port only
  std::string key_file;  ///< contains the key shared by both; empty: packets are not authenticated
};

// Columns: as those of the table (config/settings/parameter_table.cpp).
// clang-format off
inline constexpr auto kUdpHandleRows = std::to_array<config::Parameter>({
    config::row<HAPTICD_OWN_MEMBER(handle, UdpHandleSettings, address)>(
        "udp_handle.address", config::Effect::restart, "", {}, "",
        "IPv4 address of this computer at which it receives packets"),
    config::row<HAPTICD_OWN_MEMBER(handle, UdpHandleSettings, port)>(
        "udp_handle.port", config::Effect::restart, "", {1, 65535}, "",
        "UDP port of this computer"),
    config::row<HAPTICD_OWN_MEMBER(handle, UdpHandleSettings, peer)>(
        "udp_handle.peer", config::Effect::restart, "", {}, "",
        "IPv4 address of the device's computer, or address:port; packets from others are rejected"),
    config::row<HAPTICD_OWN_MEMBER(handle, UdpHandleSettings, key_file)>(
        "udp_handle.key_file", config::Effect::restart, "", {}, "",
        "file with the key shared by both computers; empty: packets are not authenticated"),
});
// clang-format on

void checkUdpHandle(const config::Settings& settings, std::vector<config::Conflict>& conflicts);
/// Returns a warning if packets arrive over a network without being authenticated.
std::optional<base::Error> unauthenticatedHandle(const config::HandleSettings& settings);
std::vector<config::Need> needsOfUdpHandle(const config::HandleSettings& settings);

inline constexpr config::HandleDriver kUdpHandle{
    .word = "udp",
    .help = "any device on another computer, behind haptic-bridge or a bridge written from the protocol",
    .parameters = kUdpHandleRows,
    .check = checkUdpHandle,
    .warning = unauthenticatedHandle,
    .needs = needsOfUdpHandle};

}  // namespace hapticd::drivers

namespace hapticd::drivers::udp {

inline constexpr std::size_t kMinKeyBytes = 16;
inline constexpr std::size_t kMaxKeyBytes = 1024;

/// Reads a key: all bytes of the file as they are. An empty path gives an empty key.
/// Errors: the file cannot be read, users other than its owner and group may read or write it, or its size is
/// not within kMinKeyBytes to kMaxKeyBytes.
base::Result<std::vector<std::byte>> keyFrom(const std::string& path);

}  // namespace hapticd::drivers::udp
