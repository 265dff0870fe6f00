#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "config/error.h"
#include "daemon/control/listening_socket.h"
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

struct ServerOptions {
  std::vector<ListenerOptions> listeners;
  std::size_t max_connections = 64;
  std::size_t max_connections_per_uid = 40;
  /// Of max_connections; the rest is kept for those who may control, however many watch.
  std::size_t max_read_only_connections = 48;
  /// Of replies that clients have not read, over all connections; beyond it streams leave replies out.
  std::size_t max_output_bytes = std::size_t{2} << 20;
};

/// Varlink over Unix sockets: one epoll loop in the thread that calls run(). Nothing a client does or leaves
/// undone blocks it. Replies keep the order of the calls; a message that is no call ends its connection
/// without a reply. Who connects beyond a limit gets the error io.hapticd.Status.TooManyConnections and is
/// closed. On a socket for control, who is no member of its file's group may only read (peer.h).
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

 private:
  VarlinkServer(const ServerOptions& options, CallHandler& handler);
  config::Result<void> open();
  bool watch(int descriptor, std::uint64_t key, std::uint32_t events, int operation);

  void serve(std::uint64_t key, std::uint32_t events, const std::function<void()>& periodic);
  void accept(ListeningSocket& listener);
  void shedOne(ListeningSocket& listener);
  void pauseListening(bool paused);
  /// The error for a client that is one too many; nothing for others.
  std::optional<Reply> refusalOf(const Caller& caller) const;
  std::size_t outputBytes() const;

  void onEvents(VarlinkConnection& connection, std::uint32_t events);
  void answerCalls(VarlinkConnection& connection);
  void answer(VarlinkConnection& connection, std::string_view message);
  void settle();
  void updateInterest(VarlinkConnection& connection);
  VarlinkConnection* find(ConnectionId connection);

  ServerOptions options_;
  CallHandler& handler_;
  std::vector<ListeningSocket> listeners_;
  Descriptor epoll_;
  Descriptor stop_;     // eventfd
  Descriptor timer_;    // timerfd
  Descriptor reserve_;  // given up to refuse a client when descriptors run out
  std::unordered_map<ConnectionId, std::unique_ptr<VarlinkConnection>> connections_;
  std::vector<ConnectionId> touched_;  // looked at again by settle()
  ConnectionId next_id_;
  bool stopping_ = false;
  bool listening_paused_ = false;
};

}  // namespace hapticd::daemon
