// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace hapticd::daemon::test {

/// A client that knows nothing of the protocol but bytes; what goes out is written by hand in the tests.
class RawClient {
 public:
  static constexpr const char* kClosed = "<closed>";
  static constexpr const char* kNoAnswer = "<no answer>";

  explicit RawClient(const std::string& path);
  /// Connects a socket that is there already, for when no new one can be opened.
  static RawClient adopt(int socket, const std::string& path) { return RawClient(socket, path); }
  RawClient(RawClient&& other) noexcept;
  RawClient& operator=(RawClient&&) = delete;
  ~RawClient() { close(); }

  int descriptor() const noexcept { return socket_; }
  void send(std::string_view bytes);
  /// One message: `text` and the NUL.
  void call(std::string_view text);
  /// As many bytes as go without waiting.
  std::size_t sendWithoutWaiting(std::string_view bytes);

  /// The next message without its NUL, kClosed when there is none any more, kNoAnswer after 60 s (so long
  /// that a loaded machine does not fail).
  std::string reply();
  /// The same as JSON; discarded if it is none.
  nlohmann::json json();

  /// Whether the server would still take something; without SIGPIPE.
  bool canSend();

  /// Whether nothing has come that reply() has not given.
  bool silent() const;

  /// Says that nothing more will be sent, as `printf ... | socat` does.
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
