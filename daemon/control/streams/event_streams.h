// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "daemon/base/journal_entry.h"
#include "daemon/control/base/method_context.h"

namespace hapticd::daemon {

/// Keeps the newest events, and sends them to the streams of Events. A client that does not read its stream
/// loses the events that are dropped meanwhile. Thread: control thread only.
class EventStreams {
 public:
  std::vector<Method> methods();

  /// Adds a journal entry if it is an event.
  void add(const JournalEntry& entry);
  void feed(Replies& replies);
  void closed(ConnectionId connection);

 private:
  struct Event {
    std::uint64_t number = 0;
    config::EventKind kind{};
    OrderedJson json;
  };

  struct Stream {
    ConnectionId connection = 0;
    std::vector<config::EventKind> kinds;  ///< empty: all
    std::uint64_t next_number = 0;         ///< number of the first event that was not sent
    std::uint64_t dropped = 0;
    bool wants(const Event& event) const;
  };

  void events(const Call&, const Caller&, Replies&);
  void dropOldest();
  std::uint64_t firstFor(const Stream& stream) const;
  /// Sends as many events as the connection takes.
  void feed(Stream& stream, Replies& replies) const;

  std::deque<Event> events_;
  std::uint64_t count_ = 0;  ///< events since the start
  std::vector<Stream> streams_;
};

}  // namespace hapticd::daemon
