// SPDX-License-Identifier: Apache-2.0
#include "tests/system/support/test_sockets.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <array>
#include <chrono>

#include "tests/support/program.h"

namespace hapticd::test {
namespace {

sockaddr_un addressOf(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  return address;
}

/// Waits for something to read; false at the deadline.
bool isReadable(const base::Descriptor& socket, std::chrono::steady_clock::time_point deadline) {
  const auto left =
      std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
  pollfd descriptor{socket.get(), POLLIN, 0};
  return left.count() > 0 && ::poll(&descriptor, 1, static_cast<int>(left.count())) > 0;
}

}  // namespace

base::Descriptor boundSocket(int type, const std::string& path) {
  base::Descriptor socket(::socket(AF_UNIX, type | SOCK_CLOEXEC, 0));
  const sockaddr_un address = addressOf(path);
  EXPECT_EQ(::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  return socket;
}

void fillQueue(const std::string& path) {
  const base::Descriptor socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const sockaddr_un address = addressOf(path);
  while (::sendto(socket.get(), "x", 1, MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&address),
                  sizeof address) == 1) {
  }
}

bool isTold(const base::Descriptor& socket, std::string_view beginning) {
  const auto deadline = std::chrono::steady_clock::now() + maxPatience();
  while (isReadable(socket, deadline)) {
    std::array<char, 4096> text;
    const ssize_t count = ::recv(socket.get(), text.data(), text.size(), 0);
    if (count > 0 && std::string_view(text.data(), static_cast<std::size_t>(count)).starts_with(beginning))
      return true;
  }
  return false;
}

Client::Client(const std::string& path) : socket_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  const sockaddr_un address = addressOf(path);
  EXPECT_EQ(::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
}

void Client::send(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count <= 0) return;
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
}

void Client::sendSome(std::string_view bytes) {
  [[maybe_unused]] const ssize_t count =
      ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
}

std::string Client::reply() {
  const auto deadline = std::chrono::steady_clock::now() + maxPatience();
  std::string text;
  while (text.find('\0') == std::string::npos && isReadable(socket_, deadline)) {
    std::array<char, 4096> chunk;
    const ssize_t count = ::recv(socket_.get(), chunk.data(), chunk.size(), 0);
    if (count <= 0) break;
    text.append(chunk.data(), static_cast<std::size_t>(count));
  }
  return text;
}

}  // namespace hapticd::test
