// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/server/varlink_server.h"

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

#include "daemon/control/server/listening_socket.h"
#include "rt/base/clock.h"

namespace hapticd::daemon {
namespace {

// Keys of the epoll events: these, then the listeners, then the connections, including lingering ones.
constexpr std::uint64_t kStopKey = 0;
constexpr std::uint64_t kTimerKey = 1;
constexpr std::uint64_t kReadsKey = 2;
constexpr std::uint64_t kFirstListenerKey = 3;

/// Kernel memory for replies that a client has not read; small, so that a slow reader of a stream gets few
/// outdated states before the newest one.
constexpr int kSendBufferBytes = 32 * 1024;

/// Descriptors that are left to refuse clients, and to clients who have no connection yet; the rest of the
/// reserve is for those who may control.
constexpr std::size_t kForRefusals = 1;
constexpr std::size_t kForNewReaders = 2;
constexpr std::size_t kForControl = 4;

Reply tooManyConnections(std::size_t limit, bool per_user) {
  return {"io.hapticd.Status.TooManyConnections", {{"limit", limit}, {"perUser", per_user}}};
}

void sendOnce(const base::Descriptor& socket, const Reply& reply) {
  const std::string message = serialise(reply);
  ::send(socket.get(), message.data(), message.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
}

bool outOfDescriptors(int error) {
  return error == EMFILE || error == ENFILE || error == ENOBUFS || error == ENOMEM;
}

}  // namespace

std::chrono::nanoseconds threadTime() {
  return std::chrono::nanoseconds(rt::threadCpu_ns());
}

base::Result<std::unique_ptr<VarlinkServer>> VarlinkServer::create(const ServerOptions& options,
                                                                   CallHandler& handler) {
  std::unique_ptr<VarlinkServer> server(new VarlinkServer(options, handler));
  if (auto opened = server->open(); !opened) return std::unexpected(opened.error());
  return server;
}

VarlinkServer::VarlinkServer(const ServerOptions& options, CallHandler& handler)
    : options_(options),
      handler_(handler),
      epoll_(::epoll_create1(EPOLL_CLOEXEC)),
      reads_(::epoll_create1(EPOLL_CLOEXEC)),
      stop_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      timer_(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK)),
      reserve_(kForRefusals + kForNewReaders + kForControl),
      read_time_(std::chrono::nanoseconds(0)),
      next_id_(kFirstListenerKey + options.listeners.size()) {}

VarlinkServer::~VarlinkServer() {
  for (auto& [id, connection] : connections_) handler_.closed(id);
}

base::Result<void> VarlinkServer::open() {
  bool good = epoll_ && reads_ && stop_ && timer_;
  good = good && watch(epoll_, stop_.get(), kStopKey, EPOLLIN, EPOLL_CTL_ADD);
  good = good && watch(epoll_, timer_.get(), kTimerKey, EPOLLIN, EPOLL_CTL_ADD);
  good = good && watch(epoll_, reads_.get(), kReadsKey, EPOLLIN, EPOLL_CTL_ADD);
  for (const ListenerOptions& listener_options : options_.listeners) {
    auto listener = ListeningSocket::open(listener_options);
    if (!listener) return std::unexpected(listener.error());
    listeners_.push_back(std::move(*listener));
    const std::uint64_t key = kFirstListenerKey + listeners_.size() - 1;
    good = good && watch(epollOf(listener_options.access), listeners_.back().descriptor(), key, EPOLLIN,
                         EPOLL_CTL_ADD);
  }
  if (!good) {
    return base::failure("control API", std::string("cannot set up epoll: ") + std::strerror(errno),
                         "raise the limit of open files");
  }
  reserve_.refill();
  const ServerLimits limits = limitsWithin(
      {options_.read_limits, options_.control_limits, LingeringSockets::kMaxSockets}, freeDescriptors());
  options_.read_limits = limits.read;
  options_.control_limits = limits.control;
  lingering_.limit(limits.lingering);
  return {};
}

bool VarlinkServer::watch(const base::Descriptor& epoll, int descriptor, std::uint64_t key,
                          std::uint32_t events, int operation) {
  epoll_event event{};
  event.events = events;
  event.data.u64 = key;
  return ::epoll_ctl(epoll.get(), operation, descriptor, &event) == 0;
}

void VarlinkServer::run(std::chrono::milliseconds period, const Periodic& periodic) {
  period_ = period;
  setTimer(idlePeriod());
  read_time_ = TimeShare(std::chrono::duration_cast<std::chrono::nanoseconds>(options_.read_share * period));

  for (;;) {
    takeEvents(epoll_, timeout_ms(), periodic);
    if (stopping_) return;
    updateTouched();
    serveControl();
    serveReads(periodic);
    updateTouched();
  }
}

std::chrono::milliseconds VarlinkServer::idlePeriod() const {
  return options_.idle_period.count() > 0 ? options_.idle_period : period_;
}

/// Lets the timer expire after `period`, and then after each further one.
void VarlinkServer::setTimer(std::chrono::milliseconds period) {
  if (period == timer_period_) return;
  timer_period_ = period;
  itimerspec interval{};
  interval.it_interval.tv_sec = period.count() / 1000;
  interval.it_interval.tv_nsec = period.count() % 1000 * 1'000'000;
  interval.it_value = interval.it_interval;
  ::timerfd_settime(timer_.get(), 0, &interval, nullptr);
}

void VarlinkServer::requestStop() noexcept {
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(stop_.get(), &one, sizeof one);
}

/// How long epoll may wait: not at all while a connection is queued.
int VarlinkServer::timeout_ms() const {
  return control_queue_.empty() && (read_queue_.empty() || reads_paused_) ? -1 : 0;
}

void VarlinkServer::takeEvents(const base::Descriptor& epoll, int timeout_ms, const Periodic& periodic) {
  std::array<epoll_event, 64> events;
  const int count = ::epoll_wait(epoll.get(), events.data(), static_cast<int>(events.size()), timeout_ms);
  for (int i = 0; i < count; ++i) {
    const epoll_event& event = events[static_cast<std::size_t>(i)];
    dispatch(event.data.u64, event.events, periodic);
  }
}

void VarlinkServer::dispatch(std::uint64_t key, std::uint32_t events, const Periodic& periodic) {
  if (key == kStopKey) {
    stopping_ = true;
  } else if (key == kTimerKey) {
    onTimer(periodic);
  } else if (key == kReadsKey) {
    reads_wait_ = true;
  } else if (key - kFirstListenerKey < listeners_.size()) {
    accept(listeners_[key - kFirstListenerKey]);
  } else if (VarlinkConnection* connection = find(key)) {
    onEvents(*connection, events);
  } else {
    lingering_.drain(key);
  }
}

void VarlinkServer::onTimer(const Periodic& periodic) {
  std::uint64_t expirations = 0;
  if (::read(timer_.get(), &expirations, sizeof expirations) < 0) return;
  if (listening_paused_) pauseListening(false);
  lingering_.closeOld(LingeringSockets::Clock::now());
  read_time_.beginPeriod();
  if (reads_paused_ && read_time_.isLeft()) pauseReads(false);
  periodic();
  setTimer(connections_.empty() ? idlePeriod() : period_);
}

void VarlinkServer::serveControl() {
  for (std::size_t calls = control_queue_.size(); calls > 0; --calls) serveNext(control_queue_);
}

void VarlinkServer::serveReads(const Periodic& periodic) {
  if (reads_paused_ || (!reads_wait_ && read_queue_.empty())) return;
  const auto begin = options_.thread_time();
  if (std::exchange(reads_wait_, false)) takeEvents(reads_, 0, periodic);
  if (!read_queue_.empty()) serveNext(read_queue_);
  read_time_.spend(options_.thread_time() - begin);
  if (!read_time_.isLeft()) pauseReads(true);
}

void VarlinkServer::pauseReads(bool paused) {
  reads_paused_ = paused;
  watch(epoll_, reads_.get(), kReadsKey, paused ? 0 : static_cast<std::uint32_t>(EPOLLIN), EPOLL_CTL_MOD);
}

void VarlinkServer::accept(ListeningSocket& listener) {
  reserve_.refill();  // before clients take what has become free
  base::Descriptor socket(::accept4(listener.descriptor(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
  if (!socket) {
    if (outOfDescriptors(errno)) acceptFromReserve(listener);
    return;
  }
  const auto caller = callerAt(socket, listener);
  if (!caller) return;
  if (const auto refusal = refusalOf(*caller)) return refuse(std::move(socket), *refusal);
  admit(std::move(socket), *caller);
}

void VarlinkServer::admit(base::Descriptor socket, const Caller& caller) {
  ::setsockopt(socket.get(), SOL_SOCKET, SO_SNDBUF, &kSendBufferBytes, sizeof kSendBufferBytes);
  if (!watch(epollOf(caller.access), socket.get(), caller.connection, EPOLLIN, EPOLL_CTL_ADD)) return;
  ++next_id_;
  auto connection = std::make_unique<VarlinkConnection>(std::move(socket), caller);
  connection->interest = EPOLLIN;
  connections_.emplace(caller.connection, std::move(connection));
  setTimer(period_);
}

/// The client of a new connection; nothing if the kernel does not report it.
std::optional<Caller> VarlinkServer::callerAt(const base::Descriptor& socket,
                                              const ListeningSocket& listener) const {
  const auto peer = peerOf(socket.get());
  if (!peer) return std::nullopt;
  const bool control = listener.access() == Access::control && mayControl(*peer, listener.group());
  const bool may_control = std::ranges::any_of(listeners_, [&](const ListeningSocket& other) {
    return other.access() == Access::control && mayControl(*peer, other.group());
  });
  return Caller{.connection = next_id_,
                .access = control ? Access::control : Access::read,
                .uid = peer->uid,
                .pid = peer->pid,
                .sees_depth = may_control || isMember(*peer, options_.view_group),
                .may_control = may_control};
}

void VarlinkServer::refuse(base::Descriptor socket, const Reply& reason) {
  ++refused_;
  sendOnce(socket, reason);
  linger(std::move(socket));
}

/// Keeps a connection that got its final reply until its client has read it.
void VarlinkServer::linger(base::Descriptor socket) {
  const ConnectionId id = next_id_++;
  if (watch(reads_, socket.get(), id, EPOLLIN, EPOLL_CTL_ADD)) {
    lingering_.add(id, std::move(socket), LingeringSockets::Clock::now());
  }
}

/// Accepts the waiting client in place of a descriptor of the reserve, to serve or to refuse it: it would
/// otherwise keep the listener readable and the loop busy.
void VarlinkServer::acceptFromReserve(ListeningSocket& listener) {
  reserve_.release();
  base::Descriptor socket(::accept4(listener.descriptor(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
  if (!socket) return pauseListening(true);
  const auto caller = callerAt(socket, listener);
  if (caller && !refusalOf(*caller) && mayUseReserve(*caller)) return admit(std::move(socket), *caller);
  ++refused_;
  sendOnce(socket, tooManyConnections(connections_.size(), false));
  socket.close();  // before the reserve is opened again in its place
  reserve_.refill();
}

bool VarlinkServer::mayUseReserve(const Caller& caller) const {
  if (caller.access == Access::control) return reserve_.held() >= kForRefusals;
  const bool is_new = std::ranges::none_of(connections_, [&](const auto& entry) {
    return entry.second->caller().access == Access::read && entry.second->caller().uid == caller.uid;
  });
  return is_new && reserve_.held() >= kForRefusals + (caller.may_control ? 0 : kForControl);
}

void VarlinkServer::pauseListening(bool paused) {
  listening_paused_ = paused;
  for (std::size_t i = 0; i < listeners_.size(); ++i) {
    const std::uint32_t events = paused ? 0 : static_cast<std::uint32_t>(EPOLLIN);
    watch(epollOf(listeners_[i].access()), listeners_[i].descriptor(), kFirstListenerKey + i, events,
          EPOLL_CTL_MOD);
  }
}

std::optional<Reply> VarlinkServer::refusalOf(const Caller& caller) const {
  const ConnectionLimits& limits =
      caller.access == Access::control ? options_.control_limits : options_.read_limits;
  std::size_t all = 0;
  std::size_t of_user = 0;
  for (const auto& [id, connection] : connections_) {
    if (connection->caller().access != caller.access) continue;
    ++all;
    if (connection->caller().uid == caller.uid) ++of_user;
  }
  if (of_user >= limits.per_user) return tooManyConnections(limits.per_user, true);
  if (all >= limits.all) return tooManyConnections(limits.all, false);
  return std::nullopt;
}

std::size_t VarlinkServer::outputBytes() const {
  std::size_t bytes = 0;
  for (const auto& [id, connection] : connections_) {
    if (!connection->dead) bytes += connection->outputBytes();
  }
  return bytes;
}

/// Closes connections that only read, as long as the clients together have too much unread.
void VarlinkServer::makeRoomFor(std::size_t bytes) {
  while (outputBytes() + bytes > options_.max_held_bytes) {
    VarlinkConnection* fullest = nullptr;
    for (const auto& [id, connection] : connections_) {
      if (connection->dead || connection->caller().access != Access::read || connection->outputEmpty())
        continue;
      if (!fullest || connection->outputBytes() > fullest->outputBytes()) fullest = connection.get();
    }
    if (!fullest) return;
    fullest->dead = true;
    touched_.push_back(fullest->caller().connection);
  }
}

void VarlinkServer::onEvents(VarlinkConnection& connection, std::uint32_t events) {
  touched_.push_back(connection.caller().connection);
  if (events & EPOLLOUT) connection.flush();
  if (events & EPOLLIN) connection.input_waits = true;
  if (events & (EPOLLHUP | EPOLLERR)) hangUp(connection);
}

/// A client that has left may have sent calls before, above all oneway calls; they are carried out if they
/// may change something.
void VarlinkServer::hangUp(VarlinkConnection& connection) {
  connection.gone = true;
  connection.dead = connection.caller().access == Access::read || !connection.readyForCall();
  // epoll would report it in every round.
  watch(epollOf(connection.caller().access), connection.descriptor(), 0, 0, EPOLL_CTL_DEL);
}

/// Handles one call of the connection at the head of the queue.
void VarlinkServer::serveNext(Queue& queue) {
  const ConnectionId id = queue.front();
  queue.pop_front();
  VarlinkConnection* connection = find(id);
  if (!connection) return;
  connection->queued = false;
  touched_.push_back(id);
  if (connection->readyForCall()) serveOneCall(*connection);
}

void VarlinkServer::serveOneCall(VarlinkConnection& connection) {
  auto message = connection.takeMessage();
  if (!message && connection.receive()) message = connection.takeMessage();
  if (message) {
    answer(connection, *message);
  } else if (connection.overfull()) {
    reject(connection, "a call is longer than 64 KiB, or its end, a NUL, is missing");
  } else if (connection.inputEnded()) {
    connection.dead = true;
  }
}

void VarlinkServer::answer(VarlinkConnection& connection, std::string_view message) {
  auto call = parseCall(message);
  if (!call) return reject(connection, call.error());
  if (base::Descriptor passed = connection.takeDescriptor(); passed)
    call->descriptor = std::make_shared<base::Descriptor>(std::move(passed));
  // The replies to a oneway call find no open call and are discarded.
  connection.call_open = !call->oneway;
  handler_.handle(*call, connection.caller(), *this);
}

void VarlinkServer::reject(VarlinkConnection& connection, std::string_view reason) {
  connection.closing = true;
  connection.send(serialise(malformedCall(reason)));
}

void VarlinkServer::finish(ConnectionId id, const Reply& reply) {
  VarlinkConnection* connection = find(id);
  if (!connection || connection->dead || !connection->call_open) return;
  touched_.push_back(id);
  connection->call_open = false;
  const std::string message = serialise(reply);
  if (message.size() > kMaxReplyBytes) connection->dead = true;
  makeRoomFor(message.size());
  connection->send(message, reply.descriptor);
}

bool VarlinkServer::offer(ConnectionId id, const Reply& reply) {
  VarlinkConnection* connection = find(id);
  if (!connection || connection->dead || !connection->call_open || !connection->outputEmpty()) return false;
  touched_.push_back(id);
  const std::string message = serialise(reply);
  if (message.size() > kMaxReplyBytes || outputBytes() + message.size() > options_.max_output_bytes) {
    return false;
  }
  connection->send(message, reply.descriptor);
  return true;
}

/// Prepares each connection that was touched for the next round: its epoll events, its place in the queue, or
/// its removal.
void VarlinkServer::updateTouched() {
  for (const ConnectionId id : touched_) {
    VarlinkConnection* connection = find(id);
    if (!connection) continue;
    update(*connection);
    if (connection->dead) {
      connections_.erase(id);
      handler_.closed(id);
    }
  }
  touched_.clear();
}

void VarlinkServer::update(VarlinkConnection& connection) {
  if (connection.dead) return;
  if (connection.gone && !connection.readyForCall()) {
    connection.dead = true;
  } else if (connection.closing && connection.outputEmpty()) {
    connection.dead = true;
    watch(epollOf(connection.caller().access), connection.descriptor(), 0, 0, EPOLL_CTL_DEL);
    linger(connection.release());
  } else {
    if (!connection.queued && connection.hasInput()) enqueue(connection);
    updateInterest(connection);
  }
}

void VarlinkServer::enqueue(VarlinkConnection& connection) {
  Queue& queue = connection.caller().access == Access::control ? control_queue_ : read_queue_;
  queue.push_back(connection.caller().connection);
  connection.queued = true;
}

void VarlinkServer::updateInterest(VarlinkConnection& connection) {
  if (connection.gone) return;
  std::uint32_t events = 0;  // EPOLLHUP and EPOLLERR are always reported
  if (connection.readyForCall() && !connection.queued) events |= EPOLLIN;
  if (!connection.outputEmpty()) events |= EPOLLOUT;
  if (events == std::exchange(connection.interest, events)) return;
  const ConnectionId id = connection.caller().connection;
  if (!watch(epollOf(connection.caller().access), connection.descriptor(), id, events, EPOLL_CTL_MOD))
    connection.dead = true;
}

VarlinkConnection* VarlinkServer::find(ConnectionId id) {
  const auto found = connections_.find(id);
  return found == connections_.end() ? nullptr : found->second.get();
}

}  // namespace hapticd::daemon
