// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "config/base/descriptor.h"

namespace hapticd::test {

/// A socket of the test's own, bound to `path`; the file stays when it is closed.
base::Descriptor boundSocket(int type, const std::string& path);

/// Sends messages to a socket of type SOCK_DGRAM, until its queue is full.
void fillQueue(const std::string& path);

/// Waits for a message that begins with `beginning`; false when none comes in time.
bool isTold(const base::Descriptor& socket, std::string_view beginning);

/// A client of the daemon that sends and receives bytes, without knowledge of the protocol.
class Client {
 public:
  explicit Client(const std::string& path);

  /// Sends all bytes, unless the daemon closes the connection.
  void send(std::string_view bytes);
  /// Sends as many of the bytes as the daemon and the kernel take at once.
  void sendSome(std::string_view bytes);
  /// Returns what arrives until a NUL, the end of the connection, or a time limit that only a failure
  /// reaches.
  std::string reply();

 private:
  base::Descriptor socket_;
};

}  // namespace hapticd::test
