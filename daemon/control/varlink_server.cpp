#include "daemon/control/varlink_server.h"

#include <fcntl.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/timerfd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "daemon/control/peer.h"

namespace hapticd::daemon {
namespace {

// Keys of the epoll events: these, then the listeners, then the connections.
constexpr std::uint64_t kStopKey = 0;
constexpr std::uint64_t kTimerKey = 1;
constexpr std::uint64_t kFirstListenerKey = 2;

/// Kernel memory for replies that a client has not read; small, so that a slow reader of a stream gets few
/// old states before it gets the newest.
constexpr int kSendBufferBytes = 32 * 1024;

Descriptor openReserve() {
  return Descriptor(::open("/dev/null", O_RDONLY | O_CLOEXEC));
}

Reply tooManyConnections(std::size_t limit, bool per_user) {
  return {"io.hapticd.Status.TooManyConnections", {{"limit", limit}, {"perUser", per_user}}};
}

/// Says so to a client who is not served.
void refuse(const Descriptor& socket, const Reply& reason) {
  const std::string message = serialise(reason);
  ::send(socket.get(), message.data(), message.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
}

bool outOfDescriptors(int error) {
  return error == EMFILE || error == ENFILE || error == ENOBUFS || error == ENOMEM;
}

}  // namespace

config::Result<std::unique_ptr<VarlinkServer>> VarlinkServer::create(const ServerOptions& options,
                                                                     CallHandler& handler) {
  std::unique_ptr<VarlinkServer> server(new VarlinkServer(options, handler));
  if (auto opened = server->open(); !opened) return std::unexpected(opened.error());
  return server;
}

VarlinkServer::VarlinkServer(const ServerOptions& options, CallHandler& handler)
    : options_(options),
      handler_(handler),
      epoll_(::epoll_create1(EPOLL_CLOEXEC)),
      stop_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      timer_(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK)),
      reserve_(openReserve()),
      next_id_(kFirstListenerKey + options.listeners.size()) {}

VarlinkServer::~VarlinkServer() {
  for (auto& [id, connection] : connections_) handler_.closed(id);
}

config::Result<void> VarlinkServer::open() {
  bool good = epoll_ && stop_ && timer_;
  good = good && watch(stop_.get(), kStopKey, EPOLLIN, EPOLL_CTL_ADD);
  good = good && watch(timer_.get(), kTimerKey, EPOLLIN, EPOLL_CTL_ADD);
  for (const ListenerOptions& wanted : options_.listeners) {
    auto listener = ListeningSocket::open(wanted);
    if (!listener) return std::unexpected(listener.error());
    listeners_.push_back(std::move(*listener));
    const std::uint64_t key = kFirstListenerKey + listeners_.size() - 1;
    good = good && watch(listeners_.back().descriptor(), key, EPOLLIN, EPOLL_CTL_ADD);
  }
  if (!good) {
    return std::unexpected(config::Error{"control API",
                                         std::string("cannot set up epoll: ") + std::strerror(errno),
                                         "raise the limit of open files"});
  }
  return {};
}

bool VarlinkServer::watch(int descriptor, std::uint64_t key, std::uint32_t events, int operation) {
  epoll_event event{};
  event.events = events;
  event.data.u64 = key;
  return ::epoll_ctl(epoll_.get(), operation, descriptor, &event) == 0;
}

void VarlinkServer::run(std::chrono::milliseconds period, const std::function<void()>& periodic) {
  itimerspec interval{};
  interval.it_interval.tv_sec = period.count() / 1000;
  interval.it_interval.tv_nsec = period.count() % 1000 * 1'000'000;
  interval.it_value = interval.it_interval;
  ::timerfd_settime(timer_.get(), 0, &interval, nullptr);

  std::array<epoll_event, 64> events;
  while (!stopping_) {
    const int count = ::epoll_wait(epoll_.get(), events.data(), static_cast<int>(events.size()), -1);
    for (int i = 0; i < count; ++i) {
      const epoll_event& event = events[static_cast<std::size_t>(i)];
      serve(event.data.u64, event.events, periodic);
    }
    settle();
  }
}

void VarlinkServer::requestStop() noexcept {
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(stop_.get(), &one, sizeof one);
}

void VarlinkServer::serve(std::uint64_t key, std::uint32_t events, const std::function<void()>& periodic) {
  if (key == kStopKey) {
    stopping_ = true;
  } else if (key == kTimerKey) {
    std::uint64_t expirations = 0;
    if (::read(timer_.get(), &expirations, sizeof expirations) < 0) return;
    if (listening_paused_) pauseListening(false);
    periodic();
  } else if (key - kFirstListenerKey < listeners_.size()) {
    accept(listeners_[key - kFirstListenerKey]);
  } else if (VarlinkConnection* connection = find(key)) {
    onEvents(*connection, events);
  }
}

void VarlinkServer::accept(ListeningSocket& listener) {
  Descriptor socket(::accept4(listener.descriptor(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
  if (!socket) {
    if (outOfDescriptors(errno)) shedOne(listener);
    return;
  }
  const auto peer = peerOf(socket.get());
  if (!peer) return;
  const bool control = listener.access() == Access::control && mayControl(*peer, listener.group());
  const Caller caller{next_id_, control ? Access::control : Access::read, peer->uid, peer->pid};
  if (const auto refusal = refusalOf(caller)) {
    refuse(socket, *refusal);
    return;
  }

  ::setsockopt(socket.get(), SOL_SOCKET, SO_SNDBUF, &kSendBufferBytes, sizeof kSendBufferBytes);
  if (!watch(socket.get(), caller.connection, EPOLLIN, EPOLL_CTL_ADD)) return;
  ++next_id_;
  connections_.emplace(caller.connection, std::make_unique<VarlinkConnection>(std::move(socket), caller));
}

/// Refuses the waiting client, who would otherwise keep the listener readable and the loop spinning.
void VarlinkServer::shedOne(ListeningSocket& listener) {
  reserve_.close();
  Descriptor refused(::accept4(listener.descriptor(), nullptr, nullptr, SOCK_CLOEXEC));
  if (refused) {
    refuse(refused, tooManyConnections(connections_.size(), false));
  } else {
    pauseListening(true);
  }
  refused.close();  // before the reserve takes its place again
  reserve_ = openReserve();
}

void VarlinkServer::pauseListening(bool paused) {
  listening_paused_ = paused;
  for (std::size_t i = 0; i < listeners_.size(); ++i) {
    const std::uint32_t events = paused ? 0 : static_cast<std::uint32_t>(EPOLLIN);
    watch(listeners_[i].descriptor(), kFirstListenerKey + i, events, EPOLL_CTL_MOD);
  }
}

std::optional<Reply> VarlinkServer::refusalOf(const Caller& caller) const {
  const auto count = [this](auto matches) {
    return static_cast<std::size_t>(std::ranges::count_if(
        connections_, [&](const auto& entry) { return matches(entry.second->caller()); }));
  };
  if (connections_.size() >= options_.max_connections) {
    return tooManyConnections(options_.max_connections, false);
  }
  if (count([&](const Caller& other) { return other.uid == caller.uid; }) >=
      options_.max_connections_per_uid) {
    return tooManyConnections(options_.max_connections_per_uid, true);
  }
  if (caller.access == Access::read && count([](const Caller& other) {
                                         return other.access == Access::read;
                                       }) >= options_.max_read_only_connections) {
    return tooManyConnections(options_.max_read_only_connections, false);
  }
  return std::nullopt;
}

std::size_t VarlinkServer::outputBytes() const {
  std::size_t bytes = 0;
  for (const auto& [id, connection] : connections_) bytes += connection->outputBytes();
  return bytes;
}

void VarlinkServer::onEvents(VarlinkConnection& connection, std::uint32_t events) {
  touched_.push_back(connection.caller().connection);
  if (events & EPOLLOUT) connection.flush();
  // A client that has left may have sent calls before, oneway ones above all; they count.
  const bool gone = (events & (EPOLLHUP | EPOLLERR)) != 0;
  bool received = true;
  while (received) {
    received = connection.readyForCall() && connection.receive();
    answerCalls(connection);
    received = received && gone;
  }
  if (gone) connection.dead = true;
}

void VarlinkServer::answerCalls(VarlinkConnection& connection) {
  while (connection.readyForCall()) {
    const auto message = connection.takeMessage();
    if (!message) break;
    answer(connection, *message);
  }
  if (connection.readyForCall() && (connection.overfull() || connection.inputEnded())) connection.dead = true;
}

void VarlinkServer::answer(VarlinkConnection& connection, std::string_view message) {
  const auto call = parseCall(message);
  if (!call) {
    connection.dead = true;
    return;
  }
  // The replies to a oneway call find no open call and are thrown away.
  connection.call_open = !call->oneway;
  handler_.handle(*call, connection.caller(), *this);
}

void VarlinkServer::finish(ConnectionId id, const Reply& reply) {
  VarlinkConnection* connection = find(id);
  if (!connection || connection->dead || !connection->call_open) return;
  touched_.push_back(id);
  connection->call_open = false;
  const std::string message = serialise(reply);
  if (message.size() > kMaxReplyBytes) connection->dead = true;
  connection->send(message);
}

bool VarlinkServer::offer(ConnectionId id, const Reply& reply) {
  VarlinkConnection* connection = find(id);
  if (!connection || connection->dead || !connection->call_open || !connection->outputEmpty()) return false;
  touched_.push_back(id);
  const std::string message = serialise(reply);
  if (message.size() > kMaxReplyBytes || outputBytes() + message.size() > options_.max_output_bytes) {
    return false;
  }
  connection->send(message);
  return true;
}

/// Brings each connection that something happened to into a state that epoll can wait for, and removes the
/// dead.
void VarlinkServer::settle() {
  for (std::size_t i = 0; i < touched_.size(); ++i) {  // answering touches more
    const ConnectionId id = touched_[i];
    VarlinkConnection* connection = find(id);
    if (!connection) continue;
    answerCalls(*connection);
    if (!connection->dead) updateInterest(*connection);
    if (connection->dead) {
      connections_.erase(id);
      handler_.closed(id);
    }
  }
  touched_.clear();
}

void VarlinkServer::updateInterest(VarlinkConnection& connection) {
  std::uint32_t events = 0;  // EPOLLHUP and EPOLLERR are always told
  if (connection.readyForCall()) events |= EPOLLIN;
  if (!connection.outputEmpty()) events |= EPOLLOUT;
  if (!watch(connection.descriptor(), connection.caller().connection, events, EPOLL_CTL_MOD))
    connection.dead = true;
}

VarlinkConnection* VarlinkServer::find(ConnectionId id) {
  const auto found = connections_.find(id);
  return found == connections_.end() ? nullptr : found->second.get();
}

}  // namespace hapticd::daemon
