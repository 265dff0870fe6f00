// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace hapticd::tools::view {

/// One WebSocket message to a client: `head`, and after it `body`, which several clients may share.
struct Message {
  bool is_text = false;
  std::string head = {};
  std::span<const std::byte> body = {};
  std::shared_ptr<const void> owner = {};  ///< keeps `body` alive; null where there is none

  std::size_t size() const { return head.size() + body.size(); }
};

inline Message textMessage(std::string text) {
  return {.is_text = true, .head = std::move(text)};
}

/// Decides what becomes of a message that the client has not taken yet.
enum class MessageKey : std::uint64_t {
  /// Sent in order. The oldest is dropped when more than MessageSink::kMaxQueued messages or
  /// kMaxQueuedBytes wait.
  queued = 0,
  // Any other value, chosen by the session: a newer message with the same key replaces the waiting one. The
  // largest are dropped where clients leave too many bytes waiting.
};

/// The outgoing side of one client's WebSocket. Memory is bounded in bytes, whatever the client reads: a
/// message in transmission, one waiting message per key, and the queue.  Thread: the io_context's.
class MessageSink {
 public:
  static constexpr std::size_t kMaxQueued = 256;
  static constexpr std::size_t kMaxQueuedBytes = 1024 * 1024;

  virtual ~MessageSink() = default;

  /// Sends a message as soon as the client has taken those before it. Queued messages go before keyed ones;
  /// those of different keys take turns. Does nothing once the connection is closed.
  virtual void send(Message message, MessageKey key) = 0;

  /// Whether a message with this key still waits to be transmitted. A session that sums up rather than
  /// replaces asks this before it sends.
  virtual bool waits(MessageKey key) const = 0;

  /// Removes the waiting message with this key, because no other one will follow it.
  virtual void withdraw(MessageKey key) = 0;

  /// Closes the connection with the WebSocket's status 1008 (policy violation). `reason`: for the log, and
  /// its first 123 bytes for the client.
  virtual void close(std::string_view reason) = 0;
};

}  // namespace hapticd::tools::view
