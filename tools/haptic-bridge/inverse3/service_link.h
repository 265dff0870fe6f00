// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "config/base/error.h"

namespace hapticd::tools::inverse3 {

/// Where a service listens.
struct ServiceEndpoint {
  std::string address;  ///< numeric, so that no name server can hold the program up
  std::uint16_t port = 0;

  std::string text() const;
};

/// Parses ADDRESS:PORT; ADDRESS is an IPv4 address or `localhost`.  Errors: anything else.
base::Result<ServiceEndpoint> serviceEndpointFrom(const std::string& text);

/// Whether to give up waiting, asked at least each 20 ms.
using GivesUp = std::function<bool()>;

/// Returns the body of the answer to GET `target`.
/// Errors: no connection, no whole answer in time, another status than 200, over 1 MiB.
base::Result<std::string> httpGet(const ServiceEndpoint& endpoint, const std::string& target,
                                  std::chrono::milliseconds patience, const GivesUp& gives_up);

/// A WebSocket to a service. No function waits longer than it says, whatever the service does.
/// Thread: one.
class ServiceLink {
 public:
  /// Errors: no connection or no WebSocket in time.
  static base::Result<ServiceLink> open(const ServiceEndpoint& endpoint, std::chrono::milliseconds patience,
                                        const GivesUp& gives_up);
  ServiceLink(ServiceLink&&) noexcept;
  ServiceLink& operator=(ServiceLink&&) noexcept;
  /// Drops the connection without the closing handshake.
  ~ServiceLink();

  /// Sends a text message.  Errors: the connection is lost, or the service has taken nothing for 100 ms.
  base::Result<void> send(const std::string& text);
  /// The oldest message that has arrived, or arrives within `patience`, rounded up to whole milliseconds;
  /// nothing: none did.  Errors: the connection is lost and all that came before was returned.
  base::Result<std::optional<std::string>> receive(std::chrono::nanoseconds patience);
  /// Performs the closing handshake, for at most 200 ms, and drops the connection.
  void close();

 private:
  class Socket;
  explicit ServiceLink(std::unique_ptr<Socket> socket);

  std::unique_ptr<Socket> socket_;
};

}  // namespace hapticd::tools::inverse3
