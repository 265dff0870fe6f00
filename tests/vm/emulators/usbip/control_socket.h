// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/base/error.h"

/// Words of the commands that an emulator takes over its control socket.
namespace hapticd::test::usbip {

/// Returns a decimal number that is the whole text.
inline std::optional<std::uint32_t> wholeNumber(std::string_view text) {
  std::uint32_t number = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (failure != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return number;
}

/// Returns the text after `word` and a space.
inline std::optional<std::string_view> argumentsOf(std::string_view line, std::string_view word) {
  if (!line.starts_with(word) || line.size() <= word.size() || line[word.size()] != ' ') return std::nullopt;
  return line.substr(word.size() + 1);
}

/// A Unix stream socket that takes commands, a line each, and answers each with a line.  Thread: one.
class ControlSocket {
 public:
  /// Answers one command (without the line's end) with one line (without it).
  using Handler = std::function<std::string(std::string_view)>;

  /// Opens the socket; a socket file left by a process that has ended is replaced.
  /// Errors: somebody listens there already, the path is too long or cannot be used.
  static base::Result<std::unique_ptr<ControlSocket>> listen(const std::filesystem::path& path);
  ~ControlSocket();
  ControlSocket(const ControlSocket&) = delete;
  ControlSocket& operator=(const ControlSocket&) = delete;

  /// Readable whenever serve() has something to do.
  int readable() const { return events_; }
  /// Answers what has arrived; does not wait.
  void serve(const Handler& handler);

 private:
  struct Client {
    int socket;
    std::string unfinished;  // of a line
  };

  ControlSocket(std::filesystem::path path, int listener, int events)
      : path_(std::move(path)), listener_(listener), events_(events) {}
  void accept();
  static bool serveClient(Client& client, const Handler& handler);

  std::filesystem::path path_;
  int listener_;
  int events_;  // an epoll of all the others
  std::vector<Client> clients_;
};

/// Sends one command to such a socket and returns the answer.  Errors: nobody listens, no answer.
base::Result<std::string> tell(const std::filesystem::path& path, const std::string& command);

}  // namespace hapticd::test::usbip
