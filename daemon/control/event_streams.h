// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "daemon/base/journal_entry.h"
#include "daemon/control/method.h"

namespace hapticd::daemon {

/// The newest events, and the streams of Events that show them. A stream that is not read loses those that
/// are forgotten meanwhile.
/// Thread: control thread only.
class EventStreams {
 public:
  std::vector<Method> methods();

  /// An entry with a field EVENT, which names its kind, is an event.
  void add(const JournalEntry& entry);
  void feed(Replies& replies);
  void closed(ConnectionId connection);

 private:
  struct Event {
    std::uint64_t number = 0;
    std::string kind;
    OrderedJson json;
  };

  struct Stream {
    ConnectionId connection = 0;
    std::vector<std::string> kinds;  ///< empty: all
    std::uint64_t next_number = 0;   ///< of the first event that was not sent
    std::uint64_t dropped = 0;
    bool wants(const Event& event) const;
  };

  void events(const Call&, const Caller&, Replies&);
  void forgetOldest();
  std::uint64_t firstFor(const Stream& stream) const;
  /// Sends what it takes.
  void feed(Stream& stream, Replies& replies) const;

  std::deque<Event> events_;
  std::uint64_t count_ = 0;  ///< since the start
  std::vector<Stream> streams_;
};

}  // namespace hapticd::daemon
