// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "config/base/descriptor.h"
#include "config/base/error.h"
#include "drivers/handle/udp/udp_settings.h"

namespace hapticd::drivers::udp {

/// A non-blocking UDP socket.
/// Thread: one.
class UdpSocket {
 public:
  /// A received datagram.
  struct Datagram {
    std::span<const std::byte> bytes;  ///< in the buffer of receive(); truncated to its size
    Ipv4Endpoint from;
  };

  UdpSocket() = default;

  /// Opens a socket bound to `local`.  Errors: the address is not (yet) this computer's, the port is taken or
  /// not permitted.
  static base::Result<UdpSocket> boundTo(const Ipv4Endpoint& local);

  bool isOpen() const { return static_cast<bool>(descriptor_); }
  /// For poll().
  int descriptor() const { return descriptor_.get(); }

  /// Returns the next datagram; nothing if there is none.
  std::optional<Datagram> receive(std::span<std::byte> buffer) const;

  /// Sends a datagram. Returns 0 or errno.
  int send(std::span<const std::byte> bytes, const Ipv4Endpoint& to) const;

 private:
  base::Descriptor descriptor_;
};

}  // namespace hapticd::drivers::udp
