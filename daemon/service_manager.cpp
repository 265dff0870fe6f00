// SPDX-License-Identifier: Apache-2.0
#include "daemon/service_manager.h"

#include <fmt/format.h>
#include <systemd/sd-daemon.h>

#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <utility>

namespace hapticd::daemon {
namespace {

/// Changes of state that may wait; the first to be dropped is the oldest.
constexpr std::size_t kMaxWaiting = 16;

}  // namespace

ServiceManager::ServiceManager() {
  char** names = nullptr;
  const int count = ::sd_listen_fds_with_names(1, &names);
  for (int i = 0; i < count; ++i) {
    sockets_.emplace(names[i], SD_LISTEN_FDS_START + i);
    std::free(names[i]);
  }
  std::free(names);

  std::uint64_t watchdog_us = 0;
  if (::sd_watchdog_enabled(0, &watchdog_us) > 0) feed_period_ = std::chrono::microseconds(watchdog_us / 4);
  if (const char* const address = std::getenv("NOTIFY_SOCKET")) connectTo(address);
}

/// `address`: a path or, from '@' on, a name in the abstract namespace.
void ServiceManager::connectTo(std::string address) {
  if (address.size() < 2 || address.size() >= sizeof address_.sun_path) return;
  const bool abstract = address[0] == '@';
  address_.sun_family = AF_UNIX;
  address.copy(address_.sun_path, address.size());
  if (abstract) address_.sun_path[0] = '\0';
  address_bytes_ =
      static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + address.size() + (abstract ? 0 : 1));
  socket_ = base::Descriptor(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
}

int ServiceManager::takeSocket(const std::string& name) {
  const auto found = sockets_.extract(name);
  return found ? found.mapped() : -1;
}

ServiceManager::Sent ServiceManager::trySend(const std::string& message) const {
  ssize_t sent = -1;
  do {
    sent = ::sendto(socket_.get(), message.data(), message.size(), MSG_NOSIGNAL | MSG_DONTWAIT,
                    reinterpret_cast<const sockaddr*>(&address_), address_bytes_);
  } while (sent < 0 && errno == EINTR);
  if (sent >= 0) return Sent::done;
  return errno == EAGAIN || errno == EWOULDBLOCK || errno == ENOBUFS ? Sent::full : Sent::failed;
}

void ServiceManager::send(std::string message) {
  if (!socket_) return;
  sendWaiting();
  waiting_.push_back(std::move(message));
  sendWaiting();
  if (waiting_.size() <= kMaxWaiting) return;
  waiting_.pop_front();
  ++lost_;
}

void ServiceManager::sendWaiting() {
  while (!waiting_.empty()) {
    const Sent sent = trySend(waiting_.front());
    if (sent == Sent::full) return;
    if (sent == Sent::failed) ++lost_;
    waiting_.pop_front();
  }
}

void ServiceManager::ready() {
  send("READY=1");
}

void ServiceManager::reloading() {
  const auto now_us = std::chrono::duration_cast<std::chrono::microseconds>(Clock::now().time_since_epoch());
  send(fmt::format("RELOADING=1\nMONOTONIC_USEC={}", now_us.count()));
}

void ServiceManager::stopping() {
  send("STOPPING=1\nSTATUS=stopping");
}

void ServiceManager::showState(const std::string& line) {
  if (line == state_) return;
  state_ = line;
  constexpr const char* kField = "STATUS=";
  // Of those that wait only the newest one has a meaning.
  std::erase_if(waiting_, [](const std::string& message) { return message.starts_with(kField); });
  send(kField + line);
}

void ServiceManager::feedWatchdog(std::uint64_t heartbeat, Clock::time_point now) {
  if (!socket_) return;
  sendWaiting();
  if (feed_period_ == Clock::duration::zero() || heartbeat == last_heartbeat_ ||
      now - last_fed_ < feed_period_)
    return;
  const bool fed = trySend("WATCHDOG=1") == Sent::done;
  if (!fed && !std::exchange(feed_failed_, true)) ++lost_;
  if (!fed) return;
  feed_failed_ = false;
  last_heartbeat_ = heartbeat;
  last_fed_ = now;
}

}  // namespace hapticd::daemon
