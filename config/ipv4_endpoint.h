// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "config/error.h"

namespace hapticd::config {

/// An IPv4 address with a UDP port, both in the order of this computer's bytes.
struct Ipv4Endpoint {
  std::uint32_t address = 0;  ///< 0: any of this computer's
  std::uint16_t port = 0;     ///< 0: none is named

  bool operator==(const Ipv4Endpoint&) const = default;
};

/// From "A.B.C.D" or "A.B.C.D:PORT" with PORT in 1..65535.
/// Errors (without a place): anything else; names are not looked up.
Result<Ipv4Endpoint> ipv4EndpointFrom(std::string_view text);

/// 127.0.0.0/8: nobody but this computer.
constexpr bool isLoopback(const Ipv4Endpoint& endpoint) {
  return endpoint.address >> 24 == 127;
}

/// "192.0.2.10:47800", without a port that is not named.
std::string textOf(const Ipv4Endpoint& endpoint);

}  // namespace hapticd::config
