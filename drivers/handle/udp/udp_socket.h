// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "config/descriptor.h"
#include "config/error.h"
#include "config/ipv4_endpoint.h"

namespace hapticd::drivers::udp {

/// A UDP socket that never waits.
/// Thread: one.
class UdpSocket {
 public:
  struct Datagram {
    std::span<const std::byte> bytes;  ///< in the buffer of receive(); what did not fit is cut
    config::Ipv4Endpoint from;
  };

  UdpSocket() = default;

  /// Errors: the address is not (yet) this computer's, the port is taken or not permitted.
  static config::Result<UdpSocket> boundTo(const config::Ipv4Endpoint& local);

  bool isOpen() const { return static_cast<bool>(descriptor_); }
  /// For poll().
  int descriptor() const { return descriptor_.get(); }

  /// The next datagram that has arrived; nothing: there is none.
  std::optional<Datagram> receive(std::span<std::byte> buffer) const;

  /// Returns 0, or the errno of what the system says against it.
  int send(std::span<const std::byte> bytes, const config::Ipv4Endpoint& to) const;

 private:
  config::Descriptor descriptor_;
};

}  // namespace hapticd::drivers::udp
