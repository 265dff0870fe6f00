// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "config/base/error.h"
#include "daemon/control/server/listening_socket.h"
#include "daemon/control/server/varlink_connection.h"
#include "daemon/control/server/varlink_message.h"

namespace hapticd::daemon {

/// Takes the replies to calls.
/// Thread: control thread only.
class Replies {
 public:
  virtual ~Replies() = default;
  /// Sends the last reply to the open call of a connection. Ignored if the client has left.
  virtual void finish(ConnectionId connection, const Reply& reply) = 0;
  /// Sends another reply of a stream. False, and nothing is sent, while the client has not taken the previous
  /// one: offer a newer one later.
  virtual bool offer(ConnectionId connection, const Reply& reply) = 0;
};

/// What a server offers to its clients.
/// Thread: control thread only.
class CallHandler {
 public:
  virtual ~CallHandler() = default;
  /// Answers at once, or remembers `caller.connection` and answers later. A `oneway` call is finished when
  /// this returns: its replies are discarded, and it must not be answered later.
  virtual void handle(const Call& call, const Caller& caller, Replies& replies) = 0;
  /// The client has left; its open call is to be forgotten.
  virtual void closed(ConnectionId connection) = 0;
};

/// CPU time of the calling thread.
std::chrono::nanoseconds threadTime();

struct ServerOptions {
  std::vector<ListenerOptions> listeners;
  /// Connections that only read are counted separately, so that however many there are, they take no place
  /// from connections that may control. There are fewer where the process may have few descriptors.
  ConnectionLimits read_limits{48, 40};
  ConnectionLimits control_limits{32, 24};
  /// Limit of the unread replies of all connections; beyond it streams skip replies.
  std::size_t max_output_bytes = std::size_t{2} << 20;
  /// The same limit for last replies, which are not left out: beyond it the connection that only reads and
  /// has most unread is closed.
  std::size_t max_held_bytes = std::size_t{8} << 20;
  /// The share of the thread's time for connections that only read, 0..1.
  double read_share = 0.5;
  /// The group whose members may see the depth image, in addition to those who may control.
  std::optional<gid_t> view_group = std::nullopt;
  /// Time between two calls of `periodic` while nobody is connected; 0: the same as with connections.
  std::chrono::milliseconds idle_period{0};
  /// The clock by which read_share is measured.
  std::chrono::nanoseconds (*thread_time)() = threadTime;
};

/// A Varlink server on Unix sockets: one epoll loop in the thread that calls run(). No client can block it,
/// whatever it does or fails to do. Each round handles first the request to stop, the timer, new connections
/// for control and one call of each connection for control, then one call of one connection that only reads;
/// those take turns, and together they get a share of the thread's time. Replies keep the order of the calls.
/// A message that is not a call is answered with io.hapticd.Status.MalformedCall and ends its connection. A
/// connection beyond a limit gets io.hapticd.Status.TooManyConnections and is closed. On a socket for control
/// a caller who is not a member of the group of its file may only read (listening_socket.h). When the process
/// may open no more descriptors, those who may control still get connections, and of the others those who
/// have none. Calls that a client sent before it left are still carried out if they may change something.
class VarlinkServer final : public Replies {
 public:
  /// Opens the sockets. `handler` must outlive the server.
  /// Errors: those of ListeningSocket::open(); descriptors in `options` are then partly taken over.
  static base::Result<std::unique_ptr<VarlinkServer>> create(const ServerOptions& options,
                                                             CallHandler& handler);
  /// Closes all connections and removes the socket files that it created.
  ~VarlinkServer() override;

  /// Serves until requestStop() is called, and calls `periodic` every `period`, or every idle_period.
  /// Thread: control thread.
  void run(std::chrono::milliseconds period, const std::function<void()>& periodic);
  /// Ends run(), also if it has not begun yet.
  /// Thread: any, and signal handlers.
  void requestStop() noexcept;

  void finish(ConnectionId connection, const Reply& reply) override;
  bool offer(ConnectionId connection, const Reply& reply) override;

  std::size_t connections() const noexcept { return connections_.size(); }
  /// The number of connections refused because of a limit, since the start.
  std::uint64_t refused() const noexcept { return refused_; }

 private:
  using Periodic = std::function<void()>;
  using Queue = std::deque<ConnectionId>;  // connections with input to process, in order

  VarlinkServer(const ServerOptions& options, CallHandler& handler);
  base::Result<void> open();
  static bool watch(const base::Descriptor& epoll, int descriptor, std::uint64_t key, std::uint32_t events,
                    int operation);

  int timeout_ms() const;
  void takeEvents(const base::Descriptor& epoll, int timeout_ms, const Periodic& periodic);
  void dispatch(std::uint64_t key, std::uint32_t events, const Periodic& periodic);
  void onTimer(const Periodic& periodic);
  void setTimer(std::chrono::milliseconds period);
  std::chrono::milliseconds idlePeriod() const;
  void serveControl();
  void serveReads(const Periodic& periodic);
  void pauseReads(bool paused);

  void accept(ListeningSocket& listener);
  std::optional<Caller> callerAt(const base::Descriptor& socket, const ListeningSocket& listener) const;
  void refuse(base::Descriptor socket, const Reply& reason);
  void linger(base::Descriptor socket);
  void admit(base::Descriptor socket, const Caller& caller);
  void acceptFromReserve(ListeningSocket& listener);
  bool mayUseReserve(const Caller& caller) const;
  void pauseListening(bool paused);
  /// The error for a client beyond a limit; nothing for others.
  std::optional<Reply> refusalOf(const Caller& caller) const;
  std::size_t outputBytes() const;
  void makeRoomFor(std::size_t bytes);

  void onEvents(VarlinkConnection& connection, std::uint32_t events);
  void hangUp(VarlinkConnection& connection);
  void serveNext(Queue& queue);
  void serveOneCall(VarlinkConnection& connection);
  void answer(VarlinkConnection& connection, std::string_view message);
  static void reject(VarlinkConnection& connection, std::string_view reason);
  void updateTouched();
  void update(VarlinkConnection& connection);
  void enqueue(VarlinkConnection& connection);
  void updateInterest(VarlinkConnection& connection);
  const base::Descriptor& epollOf(Access access) const { return access == Access::control ? epoll_ : reads_; }
  VarlinkConnection* find(ConnectionId connection);

  ServerOptions options_;
  CallHandler& handler_;
  std::vector<ListeningSocket> listeners_;
  base::Descriptor epoll_;     // of what is handled first, and of reads_
  base::Descriptor reads_;     // epoll of the connections that only read, and of lingering_
  base::Descriptor stop_;      // eventfd
  base::Descriptor timer_;     // timerfd
  DescriptorReserve reserve_;  // to accept clients when descriptors run out
  std::unordered_map<ConnectionId, std::unique_ptr<VarlinkConnection>> connections_;
  LingeringSockets lingering_;
  Queue control_queue_;
  Queue read_queue_;
  TimeShare read_time_;
  std::chrono::milliseconds period_{0};  // with connections
  std::chrono::milliseconds timer_period_{0};
  std::vector<ConnectionId> touched_;  // to be looked at by updateTouched()
  ConnectionId next_id_;
  std::uint64_t refused_ = 0;
  bool reads_wait_ = false;    // reads_ has events
  bool reads_paused_ = false;  // reads wait for the next period, because their time is used up
  bool stopping_ = false;
  bool listening_paused_ = false;
};

}  // namespace hapticd::daemon
