// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/descriptor.h"

namespace hapticd::test {

/// A message of a WebSocket client.
struct ClientMessage {
  int opcode = 0;  ///< 1 text, 8 close
  std::string payload;
};

/// One HTTP connection to a server, which may become a WebSocket (RFC 6455); shares no code with the client.
/// It does not block. Thread: one.
class ServerConnection {
 public:
  explicit ServerConnection(base::Descriptor socket) : socket_(std::move(socket)) {}

  int descriptor() const { return socket_.get(); }
  bool isOpen() const { return static_cast<bool>(socket_); }
  bool isWebSocket() const { return web_socket_; }
  void drop() { socket_.close(); }

  /// Takes what has arrived; drops the connection where the other side has.
  void fill();
  /// The target of a plain GET that has arrived. A request for a WebSocket is answered.
  std::optional<std::string> nextRequest();
  std::optional<ClientMessage> nextMessage();
  /// Answers a plain request, and closes.
  void answer(int status, const std::string& body);
  /// Sends a text message, or with opcode 8 a close.
  void send(std::string_view payload, int opcode = 1);

 private:
  void write(std::string_view bytes);

  base::Descriptor socket_;
  bool web_socket_ = false;
  std::string input_;
};

/// A port of 127.0.0.1 that is listened at.
base::Descriptor listenAt(int port);
int portOf(const base::Descriptor& listener);

}  // namespace hapticd::test
