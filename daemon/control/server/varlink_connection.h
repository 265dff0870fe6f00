// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/base/descriptor.h"
#include "daemon/control/server/listening_socket.h"
#include "daemon/control/server/varlink_message.h"

namespace hapticd::daemon {

/// Identifies a connection; never used twice in the life of a server.
using ConnectionId = std::uint64_t;
/// The id of no connection: a reply to it is discarded.
inline constexpr ConnectionId kNoConnection = 0;

/// The client of a connection, as the kernel recorded it when it connected.
struct Caller {
  ConnectionId connection = 0;
  Access access = Access::read;
  uid_t uid = 0;
  pid_t pid = 0;
  bool sees_depth = false;   ///< may take the depth image (listening_socket.h)
  bool may_control = false;  ///< on a socket for control; this one may be another
};

/// The bytes of one client: it splits the input into messages and keeps output that could not be sent yet.
/// Both buffers are bounded: input by the longest call, output by one reply and the end of a stream, because
/// the next call is read only when the kernel has taken the previous reply. Thread: control thread only.
/// Nothing here blocks or raises SIGPIPE.
class VarlinkConnection {
 public:
  VarlinkConnection(base::Descriptor socket, const Caller& caller);

  const Caller& caller() const noexcept { return caller_; }
  int descriptor() const noexcept { return socket_.get(); }

  /// A call is being answered; the next one waits.
  bool call_open = false;
  /// The connection is to be removed; nothing more is read or sent.
  bool dead = false;
  /// The client gets its final reply; nothing more is read.
  bool closing = false;
  /// The client has left; calls that it sent before may still be carried out.
  bool gone = false;
  /// There is input that receive() has not taken yet.
  bool input_waits = false;
  /// The connection is in one of the server's queues.
  bool queued = false;
  /// The epoll events that the server waits for.
  std::uint32_t interest = 0;

  /// Whether the next call may be taken: no call is open, and the previous reply has been sent.
  bool readyForCall() const noexcept { return !dead && !closing && !call_open && outputEmpty(); }
  /// Whether there is input to process, or its end.
  bool hasInput() noexcept;
  bool outputEmpty() const noexcept { return outputBytes() == 0; }
  /// The size of the output that the client has not taken yet, without what the kernel holds.
  std::size_t outputBytes() const noexcept { return output_.size() - sent_; }
  /// Whether the client sends no more; it may still read.
  bool inputEnded() const noexcept { return input_ended_; }

  /// Reads the available input, up to the bound. False if there was none.
  bool receive();
  /// The next whole message without its NUL; valid until the next receive().
  std::optional<std::string_view> takeMessage();
  /// Gives up the descriptor that came with the message that was taken last; none: no descriptor did. Only a
  /// client that may control can pass one, and only one with each message.
  base::Descriptor takeDescriptor() noexcept;
  /// Whether a message is longer than the bound: the client does not speak the protocol.
  bool overfull() const noexcept;
  /// Sends as much as the kernel takes and keeps the rest. Marks the connection dead if the client is gone.
  /// `descriptor`: of a file that the client gets a descriptor of with the first byte (SCM_RIGHTS); only
  /// while outputEmpty(). -1: none.
  void send(std::string_view message, int descriptor = -1);
  /// Tries again to send the rest.
  void flush();
  /// Gives up the socket; the connection cannot be used any more.
  base::Descriptor release() noexcept { return std::move(socket_); }

 private:
  std::size_t longestCall() const noexcept {
    return caller_.access == Access::control ? kMaxControlCallBytes : kMaxCallBytes;
  }
  bool hasMessage() noexcept;
  ssize_t receiveSome(char* to, std::size_t room) noexcept;
  ssize_t sendSome() noexcept;

  base::Descriptor socket_;
  Caller caller_;
  std::string input_;
  std::size_t taken_ = 0;       // bytes of input_ that takeMessage() gave out
  std::size_t scanned_ = 0;     // bytes of input_ known to hold no NUL behind taken_, counted from the start
  base::Descriptor passed_;     // the newest that came with input_ ...
  std::size_t passed_end_ = 0;  // ... and the end of the bytes that it came with
  std::string output_;
  std::size_t sent_ = 0;
  base::Descriptor attached_;  // goes with the first byte of output_
  bool input_ended_ = false;
};

/// Connections that got their final reply. Each stays open for a while, until its client leaves, and further
/// input is discarded: if it were closed with unread input, or while its client is still sending, the client
/// would see a broken pipe instead of the final reply. Thread: one.
class LingeringSockets {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMaxSockets = 32;
  static constexpr std::chrono::seconds kMaxAge{30};

  /// Beyond `most`, at most kMaxSockets, the oldest is closed.
  void limit(std::size_t most) { most_ = most; }

  /// Shuts down sending to the client, and takes the socket. `id`: names it in drain().
  void add(ConnectionId id, base::Descriptor socket, Clock::time_point now);
  /// Discards some of the input; closes the socket when its client has left.
  void drain(ConnectionId id);
  void closeOld(Clock::time_point now);

 private:
  struct Lingering {
    ConnectionId id;
    base::Descriptor socket;
    Clock::time_point end;
  };

  std::size_t most_ = kMaxSockets;
  std::vector<Lingering> sockets_;  // the oldest first
};

/// Limits on the number of simultaneous connections.
struct ConnectionLimits {
  std::size_t all = 0;
  std::size_t per_user = 0;
};

/// All connections that a server keeps.
struct ServerLimits {
  ConnectionLimits read;
  ConnectionLimits control;
  std::size_t lingering = 0;  ///< that got their final reply
};

/// Returns `limits`, or less where the process may have only `descriptors` more: what is left to files and
/// devices must suffice for them, and no user may take all places.
ServerLimits limitsWithin(const ServerLimits& limits, std::size_t descriptors);

/// How many more descriptors the process may open by its limit (RLIMIT_NOFILE).
std::size_t freeDescriptors();

/// Descriptors that are kept open, to be given up when a connection must be accepted and the process may open
/// no more.  Thread: one.
class DescriptorReserve {
 public:
  /// Holds none yet.
  explicit DescriptorReserve(std::size_t size) : size_(size) {}

  std::size_t held() const noexcept { return held_.size(); }
  /// Gives one up; does nothing if none is held.
  void release() {
    if (!held_.empty()) held_.pop_back();
  }
  /// Opens as many again as the system allows.
  void refill();

 private:
  std::size_t size_;
  std::vector<base::Descriptor> held_;
};

/// Limits the time of a thread that one kind of work may take in each period. Time taken beyond the limit is
/// deducted from the following periods. Thread: one.
class TimeShare {
 public:
  explicit TimeShare(std::chrono::nanoseconds per_period) noexcept
      : per_period_(per_period), left_(per_period) {}

  /// To be called once in a period. Unused time is not saved for later periods.
  void beginPeriod() noexcept { left_ = std::min(per_period_, left_ + per_period_); }
  void spend(std::chrono::nanoseconds time) noexcept { left_ -= time; }
  /// Whether more work may begin in this period.
  bool isLeft() const noexcept { return left_.count() > 0; }

 private:
  std::chrono::nanoseconds per_period_;
  std::chrono::nanoseconds left_;
};

}  // namespace hapticd::daemon
