// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "config/base/error.h"

namespace hapticd::config {

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

}  // namespace hapticd::config
