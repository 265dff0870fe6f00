// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <list>
#include <optional>
#include <utility>

#include "tools/hapticd-view/live/message_sink.h"

namespace hapticd::tools::view {

/// The messages for one client: those that wait, and the one in transmission. Their size is bounded, for each
/// client and for all together. What has no room is dropped and counted: of the queue the oldest, and of the
/// keyed messages the largest, which is replaced soonest. Of several clients the one with most bytes waiting
/// loses first.  Thread: one.
class Outbox {
 public:
  /// The keyed messages of one client that wait, unless a single one is larger. All points of a frame of
  /// 1280 x 800 pixels have 12 MB.
  static constexpr std::size_t kMaxKeyedBytes = 16 * 1024 * 1024;
  /// All keyed messages of all clients, with those in transmission.
  static constexpr std::size_t kMaxKeyedBytesOfAll = 64 * 1024 * 1024;

  /// Those of all clients; each adds and removes itself. Outlives them.
  using All = std::list<Outbox*>;

  explicit Outbox(All& all);
  ~Outbox();
  Outbox(const Outbox&) = delete;
  Outbox& operator=(const Outbox&) = delete;

  void add(Message message, MessageKey key);
  bool waits(MessageKey key) const;
  /// Removes the message with a key that waits, if there is one.
  void withdraw(MessageKey key);
  /// Drops what waits.
  void clear();

  /// Takes the next message into transmission; queued ones go first. Null: none waits, or one is in
  /// transmission. Valid until endTransmission().
  const Message* beginTransmission();
  void endTransmission() { in_transmission_.reset(); }
  bool isTransmitting() const { return in_transmission_.has_value(); }

  /// The size of what waits and of what is in transmission.
  std::size_t bytes() const { return queued_bytes_ + keyed_bytes_ + transmittedBytes(); }
  std::uint64_t replaced() const { return replaced_; }  ///< by newer ones
  std::uint64_t dropped() const { return dropped_; }    ///< for want of room

 private:
  using Keyed = std::deque<std::pair<MessageKey, Message>>;

  std::size_t transmittedBytes() const { return in_transmission_ ? in_transmission_->size() : 0; }
  void addQueued(Message message);
  void addKeyed(Message message, MessageKey key);
  bool makeRoom(std::size_t bytes);
  void dropLargest();
  void erase(Keyed::iterator entry);
  Keyed::iterator find(MessageKey key);

  All& all_;
  std::deque<Message> queue_;
  std::size_t queued_bytes_ = 0;
  Keyed keyed_;  // the longest waiting first
  std::size_t keyed_bytes_ = 0;
  std::optional<Message> in_transmission_;
  std::uint64_t replaced_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace hapticd::tools::view
