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

#include "config/error.h"
#include "daemon/control/lingering_sockets.h"
#include "daemon/control/listening_socket.h"
#include "daemon/control/time_share.h"
#include "daemon/control/varlink_connection.h"
#include "daemon/control/varlink_message.h"

namespace hapticd::daemon {

/// Where the answers to calls go.
/// Thread: control thread only.
class Replies {
 public:
  virtual ~Replies() = default;
  /// The last reply to the connection's open call. Ignored when there is none, because the client has left.
  virtual void finish(ConnectionId connection, const Reply& reply) = 0;
  /// One more reply of a stream. False, and nothing happens, while the client has not taken the previous one:
  /// offer a newer one later.
  virtual bool offer(ConnectionId connection, const Reply& reply) = 0;
};

/// What the server serves.
/// Thread: control thread only.
class CallHandler {
 public:
  virtual ~CallHandler() = default;
  /// Answers at once, or keeps `caller.connection` and answers later. A `oneway` call is done when this
  /// returns: what is answered is thrown away, and it must not be answered later.
  virtual void handle(const Call& call, const Caller& caller, Replies& replies) = 0;
  /// The client has left; forget its open call.
  virtual void closed(ConnectionId connection) = 0;
};

/// How many connections there may be at once.
struct ConnectionLimits {
  std::size_t all = 0;
  std::size_t per_user = 0;
};

/// CPU time of the calling thread.
std::chrono::nanoseconds threadTime();

struct ServerOptions {
  std::vector<ListenerOptions> listeners;
  /// Counted apart, so that those who only read, however many, take no place from those who may control.
  ConnectionLimits read_limits{48, 40};
  ConnectionLimits control_limits{32, 24};
  /// Of replies that clients have not read, over all connections; beyond it streams leave replies out.
  std::size_t max_output_bytes = std::size_t{2} << 20;
  /// Of the thread's time, for the connections that only read, 0..1.
  double read_share = 0.5;
  /// Its members may see the depth image, as may those who may control.
  std::optional<gid_t> view_group = std::nullopt;
  /// What read_share is measured by.
  std::chrono::nanoseconds (*thread_time)() = threadTime;
};

/// Varlink over Unix sockets: one epoll loop in the thread that calls run(). Nothing a client does or leaves
/// undone blocks it. In each round come first the request to stop, the timer, new connections for control and
/// one call of each connection for control, then one call of one connection that only reads; these take
/// turns, and together they get a share of the thread's time. Replies keep the order of the calls. What is no
/// call is answered io.hapticd.Status.MalformedCall and ends its connection. Who connects beyond a limit is
/// told io.hapticd.Status.TooManyConnections and closed. On a socket for control, who is no member of its
/// file's group may only read (peer.h). Calls that a client sent before it left are still obeyed where they
/// may change something.
class VarlinkServer final : public Replies {
 public:
  /// Opens the sockets. `handler` outlives the server.
  /// Errors: those of ListeningSocket::open(); descriptors in `options` are then partly taken over.
  static config::Result<std::unique_ptr<VarlinkServer>> create(const ServerOptions& options,
                                                               CallHandler& handler);
  /// Closes all connections and removes the socket files that it created.
  ~VarlinkServer() override;

  /// Serves until requestStop(); calls `periodic` every `period` in between.
  /// Thread: control thread.
  void run(std::chrono::milliseconds period, const std::function<void()>& periodic);
  /// Ends run(), also one that has not begun yet.
  /// Thread: any, and signal handlers.
  void requestStop() noexcept;

  void finish(ConnectionId connection, const Reply& reply) override;
  bool offer(ConnectionId connection, const Reply& reply) override;

  std::size_t connections() const noexcept { return connections_.size(); }
  /// Connections that there was no room for, since the start.
  std::uint64_t refused() const noexcept { return refused_; }

 private:
  using Periodic = std::function<void()>;
  using Line = std::deque<ConnectionId>;  // of connections that wait for their turn

  VarlinkServer(const ServerOptions& options, CallHandler& handler);
  config::Result<void> open();
  static bool watch(const config::Descriptor& epoll, int descriptor, std::uint64_t key, std::uint32_t events,
                    int operation);

  int patience_ms() const;
  void takeEvents(const config::Descriptor& epoll, int patience_ms, const Periodic& periodic);
  void dispatch(std::uint64_t key, std::uint32_t events, const Periodic& periodic);
  void onTimer(const Periodic& periodic);
  void serveControl();
  void serveReads(const Periodic& periodic);
  void holdReads(bool held);

  void accept(ListeningSocket& listener);
  std::optional<Caller> callerAt(const config::Descriptor& socket, const ListeningSocket& listener) const;
  void refuse(config::Descriptor socket, const Reply& reason);
  void linger(config::Descriptor socket);
  void shedOne(ListeningSocket& listener);
  void pauseListening(bool paused);
  /// The error for a client that is one too many; nothing for others.
  std::optional<Reply> refusalOf(const Caller& caller) const;
  std::size_t outputBytes() const;

  void onEvents(VarlinkConnection& connection, std::uint32_t events);
  void hangUp(VarlinkConnection& connection);
  void serveNext(Line& line);
  void serveOneCall(VarlinkConnection& connection);
  void answer(VarlinkConnection& connection, std::string_view message);
  static void reject(VarlinkConnection& connection, std::string_view reason);
  void settle();
  void settle(VarlinkConnection& connection);
  void standInLine(VarlinkConnection& connection);
  void updateInterest(VarlinkConnection& connection);
  const config::Descriptor& epollOf(Access access) const {
    return access == Access::control ? epoll_ : reads_;
  }
  VarlinkConnection* find(ConnectionId connection);

  ServerOptions options_;
  CallHandler& handler_;
  std::vector<ListeningSocket> listeners_;
  config::Descriptor epoll_;    // of what comes first, and of reads_
  config::Descriptor reads_;    // epoll of what is for reading, and of lingering_
  config::Descriptor stop_;     // eventfd
  config::Descriptor timer_;    // timerfd
  config::Descriptor reserve_;  // given up to refuse a client when descriptors run out
  std::unordered_map<ConnectionId, std::unique_ptr<VarlinkConnection>> connections_;
  LingeringSockets lingering_;
  Line control_line_;
  Line read_line_;
  TimeShare read_time_;
  std::vector<ConnectionId> touched_;  // looked at again by settle()
  ConnectionId next_id_;
  std::uint64_t refused_ = 0;
  bool reads_wait_ = false;  // reads_ has events
  bool reads_held_ = false;  // until the next period, because their time is used up
  bool stopping_ = false;
  bool listening_paused_ = false;
};

}  // namespace hapticd::daemon
