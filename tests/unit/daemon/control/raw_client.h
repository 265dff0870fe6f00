// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace hapticd::daemon::test {

/// A client that sends and receives bytes, which the tests write by hand.
class RawClient {
 public:
  static constexpr const char* kClosed = "<closed>";
  static constexpr const char* kNoAnswer = "<no answer>";

  explicit RawClient(const std::string& path);
  /// Connects an existing socket, for tests in which no new one can be opened.
  static RawClient adopt(int socket, const std::string& path) { return RawClient(socket, path); }
  RawClient(RawClient&& other) noexcept;
  RawClient& operator=(RawClient&&) = delete;
  ~RawClient() { close(); }

  int descriptor() const noexcept { return socket_; }
  void send(std::string_view bytes);
  /// Sends one message: `text` and the NUL.
  void call(std::string_view text);
  /// Sends one message with descriptors.
  void pass(std::string_view text, const std::vector<int>& descriptors);
  /// Sends as many bytes as possible without waiting.
  std::size_t sendWithoutWaiting(std::string_view bytes);

  /// The next message without its NUL, kClosed when there is none any more, kNoAnswer after 60 s (so long
  /// that a loaded machine does not fail).
  std::string reply();
  /// Returns the next message as JSON; a discarded value if it is not JSON.
  nlohmann::json json();

  /// Whether the server would still take something; without SIGPIPE.
  bool canSend();

  /// Whether reply() has returned everything that has arrived.
  bool silent() const;

  /// Closes the sending direction, as `printf ... | socat` does.
  void endInput();
  void close();

 private:
  RawClient(int socket, const std::string& path);

  int socket_;
  std::string input_;
};

/// `text` and the NUL.
std::string message(std::string_view text);

}  // namespace hapticd::daemon::test
