// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/descriptor.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"
#include "tests/system/support/daemon_under_test.h"

namespace hapticd::test {

/// A TCP connection to 127.0.0.1 that sends exactly the bytes it is told to, right or wrong.
class RawClient {
 public:
  /// `receive_buffer`: of the kernel, bytes; 0: its default.
  explicit RawClient(int port, int receive_buffer = 0);

  /// False where the other side no longer takes bytes.
  bool send(std::string_view bytes);
  /// Takes at most that many bytes; empty: the other side has closed, or nothing came within a minute.
  std::string receive(std::size_t most);
  /// All that comes until the other side closes.
  std::string receiveAll();
  /// Whether the other side closes the connection; what comes before is dropped.
  bool isClosed();

 private:
  base::Descriptor socket_;
};

/// One message of a WebSocket.
struct WebSocketMessage {
  int opcode = 0;  ///< 1 text, 2 binary, 8 close, 9 ping, 10 pong
  std::string payload;
};

/// The client's side of a WebSocket, RFC 6455.
class WebSocketPeer {
 public:
  /// Asks for a WebSocket. `fields`: further header lines, each with its line end.
  WebSocketPeer(int port, const std::string& target, const std::string& fields = "", int receive_buffer = 0);

  /// The header of the answer.
  const std::string& answer() const { return answer_; }
  bool isOpen() const { return answer_.starts_with("HTTP/1.1 101 "); }

  void sendText(std::string_view text) { sendFrame(0x81, text); }
  /// A masked frame with that first byte.
  void sendFrame(unsigned char first, std::string_view payload);
  RawClient& raw() { return raw_; }

  /// The next message, pings answered; nothing: the other side has closed without one.
  std::optional<WebSocketMessage> next();
  /// The next text of that type, of at most `most` messages; null: none.
  nlohmann::json nextOf(const std::string& type, int most = 2000);
  /// The next binary message, of at most `most` messages; empty: none.
  std::string nextBinary(int most = 2000);

 private:
  bool fill(std::size_t bytes);

  RawClient raw_;
  std::string answer_;
  std::string input_;
};

/// The header of a request for a WebSocket, with the empty line at its end.
std::string upgradeRequest(int port, const std::string& target, const std::string& fields = "");

/// hapticd-view, running beside the box of a DaemonHome, with a page and a token of its own.
class BridgeUnderTest {
 public:
  explicit BridgeUnderTest(const DaemonHome& home, const std::vector<std::string>& options = {});

  /// The port that it listens at; 0 (and a failed test): it does not.
  int port() const { return port_; }
  const std::string& token() const { return token_; }
  /// "/live?token=..."
  std::string liveTarget() const { return "/live?token=" + token_; }
  /// "Host: 127.0.0.1:PORT\r\nCookie: hapticd-view=...\r\n"
  std::string goodFields() const;
  Program& program() { return program_; }
  /// What it holds in memory, bytes.
  std::size_t residentBytes() const;
  /// Waits until it has logged that.
  bool logs(const std::string& text);

  /// The whole answer to a request.
  std::string answerTo(const std::string& request) const;

 private:
  TemporaryFolder folder_;
  Program program_;
  int port_ = 0;
  std::string token_;
};

}  // namespace hapticd::test
