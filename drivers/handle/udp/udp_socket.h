// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "config/error.h"
#include "config/ipv4_endpoint.h"

namespace hapticd::drivers::udp {

/// A non-blocking UDP socket.
/// Thread: one.
class UdpSocket {
 public:
  /// A received datagram.
  struct Datagram {
    std::span<const std::byte> bytes;  ///< in the buffer of receive(); truncated to its size
    config::Ipv4Endpoint from;
  };

  UdpSocket() = default;
  ~UdpSocket() { close(); }
  UdpSocket(UdpSocket&& other) noexcept;
  UdpSocket& operator=(UdpSocket&& other) noexcept;

  /// Opens a socket bound to `local`.  Errors: the address is not (yet) this computer's, the port is taken or
  /// not permitted.
  static config::Result<UdpSocket> boundTo(const config::Ipv4Endpoint& local);

  bool isOpen() const { return descriptor_ >= 0; }
  /// Returns the file descriptor, for poll().
  int descriptor() const { return descriptor_; }

  /// Returns the next datagram; nothing if there is none.
  std::optional<Datagram> receive(std::span<std::byte> buffer) const;

  /// Sends a datagram. Returns 0 or errno.
  int send(std::span<const std::byte> bytes, const config::Ipv4Endpoint& to) const;

 private:
  void close();

  int descriptor_ = -1;
};

}  // namespace hapticd::drivers::udp
