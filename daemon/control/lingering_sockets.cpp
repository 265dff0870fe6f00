// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/lingering_sockets.h"

#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

namespace hapticd::daemon {

void LingeringSockets::add(ConnectionId id, config::Descriptor socket, Clock::time_point now) {
  ::shutdown(socket.get(), SHUT_WR);
  if (sockets_.size() == most_) sockets_.erase(sockets_.begin());
  sockets_.push_back({id, std::move(socket), now + kLongest});
}

void LingeringSockets::drain(ConnectionId id) {
  const auto found = std::ranges::find(sockets_, id, &Lingering::id);
  if (found == sockets_.end()) return;
  std::array<char, 16384> waste;
  const ssize_t received = ::recv(found->socket.get(), waste.data(), waste.size(), MSG_DONTWAIT);
  const bool left =
      received == 0 || (received < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR);
  if (left) sockets_.erase(found);
}

void LingeringSockets::closeOld(Clock::time_point now) {
  std::erase_if(sockets_, [=](const Lingering& socket) { return now >= socket.end; });
}

}  // namespace hapticd::daemon
