// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/usbip/control_socket.h"

#include <fmt/format.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <optional>

namespace hapticd::test::usbip {
namespace {

constexpr std::size_t kMaxLineBytes = 1000;
constexpr int kMaxWaitingClients = 8;

std::unexpected<base::Error> refuse(const std::filesystem::path& path, std::string what, std::string remedy) {
  return std::unexpected(base::Error{path.string(), std::move(what), std::move(remedy)});
}

std::optional<sockaddr_un> addressOf(const std::filesystem::path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.native().empty() || path.native().size() >= sizeof address.sun_path) return std::nullopt;
  std::memcpy(address.sun_path, path.c_str(), path.native().size());
  return address;
}

std::unexpected<base::Error> refuseLength(const std::filesystem::path& path) {
  return refuse(path,
                fmt::format("the path has {} characters, allowed are 1 to {}", path.native().size(),
                            sizeof(sockaddr_un::sun_path) - 1),
                "choose another path for --control");
}

/// Returns a connected socket, or the negative errno.
int connectTo(const sockaddr_un& address) {
  const int socket = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (socket < 0) return -errno;
  if (::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return socket;
  const int failure = errno;
  ::close(socket);
  return -failure;
}

void watch(int events, int file) {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = file;
  ::epoll_ctl(events, EPOLL_CTL_ADD, file, &event);
}

bool sendLine(int socket, std::string line) {
  line += '\n';
  const ssize_t sent = ::send(socket, line.data(), line.size(), MSG_NOSIGNAL);
  return sent == static_cast<ssize_t>(line.size());
}

}  // namespace

base::Result<std::unique_ptr<ControlSocket>> ControlSocket::listen(const std::filesystem::path& path) {
  const auto address = addressOf(path);
  if (!address) return refuseLength(path);
  if (const int other = connectTo(*address); other >= 0) {
    ::close(other);
    return refuse(path, "somebody listens there already", "end that emulator, or choose another path");
  } else if (other == -ECONNREFUSED && std::filesystem::is_socket(path)) {
    ::unlink(path.c_str());
  }
  const int listener = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (listener < 0 || ::bind(listener, reinterpret_cast<const sockaddr*>(&*address), sizeof *address) != 0 ||
      ::listen(listener, kMaxWaitingClients) != 0) {
    const std::string why = std::strerror(errno);
    if (listener >= 0) ::close(listener);
    return refuse(path, why, "check that the folder exists and may be written");
  }
  const int events = ::epoll_create1(EPOLL_CLOEXEC);
  watch(events, listener);
  return std::unique_ptr<ControlSocket>(new ControlSocket(path, listener, events));
}

ControlSocket::~ControlSocket() {
  for (const Client& client : clients_) ::close(client.socket);
  ::close(events_);
  ::close(listener_);
  ::unlink(path_.c_str());
}

void ControlSocket::serve(const Handler& handler) {
  accept();
  std::erase_if(clients_, [&handler](Client& client) {
    if (serveClient(client, handler)) return false;
    ::close(client.socket);
    return true;
  });
}

void ControlSocket::accept() {
  for (;;) {
    const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (client < 0) return;
    watch(events_, client);
    clients_.push_back({client, {}});
  }
}

/// Serves a client; returns false if it has finished.
bool ControlSocket::serveClient(Client& client, const Handler& handler) {
  std::array<char, kMaxLineBytes> bytes{};
  const ssize_t count = ::recv(client.socket, bytes.data(), bytes.size(), MSG_DONTWAIT);
  if (count < 0) return errno == EAGAIN || errno == EINTR;
  if (count == 0) return false;
  client.unfinished.append(bytes.data(), static_cast<std::size_t>(count));
  for (std::size_t end = 0; (end = client.unfinished.find('\n')) != std::string::npos;) {
    const std::string line = client.unfinished.substr(0, end);
    client.unfinished.erase(0, end + 1);
    if (!sendLine(client.socket, handler(line))) return false;
  }
  return client.unfinished.size() <= kMaxLineBytes;
}

base::Result<std::string> tell(const std::filesystem::path& path, const std::string& command) {
  const auto address = addressOf(path);
  if (!address) return refuseLength(path);
  const int socket = connectTo(*address);
  if (socket < 0) return refuse(path, std::strerror(-socket), "start the emulator with the same --control");
  std::string answer;
  std::array<char, kMaxLineBytes> bytes{};
  if (sendLine(socket, command)) {
    while (!answer.ends_with('\n')) {
      const ssize_t count = ::recv(socket, bytes.data(), bytes.size(), 0);
      if (count <= 0) break;
      answer.append(bytes.data(), static_cast<std::size_t>(count));
    }
  }
  ::close(socket);
  if (!answer.ends_with('\n')) return refuse(path, "the emulator has ended without an answer", "");
  answer.pop_back();
  return answer;
}

}  // namespace hapticd::test::usbip
