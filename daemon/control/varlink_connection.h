// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "config/descriptor.h"
#include "daemon/control/listening_socket.h"

namespace hapticd::daemon {

/// Never used twice in the life of a server.
using ConnectionId = std::uint64_t;
/// Of none: a reply to it goes nowhere.
inline constexpr ConnectionId kNoConnection = 0;

/// Who is at the other end, as the kernel knows it from the moment of connecting.
struct Caller {
  ConnectionId connection = 0;
  Access access = Access::read;
  uid_t uid = 0;
  pid_t pid = 0;
  bool sees_depth = false;  ///< may take the depth image (peer.h)
};

/// The bytes of one client: cuts what comes in into messages and keeps what could not be sent yet. Both
/// buffers are bounded: input by kMaxCallBytes, output by one reply and the end of a stream, because the next
/// call is looked at only when the previous reply is with the kernel. Thread: control thread only. Nothing
/// here blocks or raises SIGPIPE.
class VarlinkConnection {
 public:
  VarlinkConnection(config::Descriptor socket, const Caller& caller);

  const Caller& caller() const noexcept { return caller_; }
  int descriptor() const noexcept { return socket_.get(); }

  /// A call is being answered; the next one waits.
  bool call_open = false;
  /// To be removed; nothing more is read or sent.
  bool dead = false;
  /// Gets its last word; nothing more is read.
  bool closing = false;
  /// Its client has left; what it sent before may still count.
  bool gone = false;
  /// Something has come in since the last receive().
  bool input_waits = false;
  /// In the server's line of those whose turn is to come.
  bool queued = false;
  /// The events of epoll that are waited for.
  std::uint32_t interest = 0;

  /// Whether the next call may be taken: none is open and its predecessor's reply is gone.
  bool readyForCall() const noexcept { return !dead && !closing && !call_open && outputEmpty(); }
  /// Whether there is something to do with what has come in.
  bool wantsTurn() noexcept;
  bool outputEmpty() const noexcept { return outputBytes() == 0; }
  /// What the client has not taken yet, without what the kernel holds.
  std::size_t outputBytes() const noexcept { return output_.size() - sent_; }
  /// The client sends no more (it may still read).
  bool inputEnded() const noexcept { return input_ended_; }

  /// Takes in what there is, up to the bound. False when there was nothing.
  bool receive();
  /// The next whole message without its NUL; valid until the next receive().
  std::optional<std::string_view> takeMessage();
  /// No whole message fits into the bound: the client does not speak the protocol.
  bool overfull() const noexcept;
  /// Sends what the kernel takes and keeps the rest. Marks itself dead when the client is gone.
  void send(std::string_view message);
  /// Tries again with the rest.
  void flush();
  /// Gives the socket away; the connection is of no more use.
  config::Descriptor release() noexcept { return std::move(socket_); }

 private:
  bool hasMessage() noexcept;

  config::Descriptor socket_;
  Caller caller_;
  std::string input_;
  std::size_t taken_ = 0;    // bytes of input_ that takeMessage() gave out
  std::size_t scanned_ = 0;  // bytes of input_ known to hold no NUL behind taken_, counted from the start
  std::string output_;
  std::size_t sent_ = 0;
  bool input_ended_ = false;
};

}  // namespace hapticd::daemon
