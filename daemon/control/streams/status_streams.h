// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <expected>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "daemon/base/box.h"
#include "daemon/base/journal_entry.h"
#include "daemon/control/base/method_context.h"
#include "daemon/control/server/varlink_message.h"
#include "daemon/status/box_status.h"
#include "rt/base/latency_histogram.h"

namespace hapticd::daemon {

/// Summarises ticks until the summary has been read.
/// Thread: one.
class TickWindow {
 public:
  void add(const rt::Tick& tick);
  void clear() { *this = TickWindow(); }

  WindowStatus summary() const;

 private:
  struct Times {
    rt::LatencyHistogram wakeup_latency;
    rt::LatencyHistogram compute_time;
  };

  WindowStatus summary_;                                      ///< without the percentiles
  std::unique_ptr<Times> times_ = std::make_unique<Times>();  // 8 KiB, too much to be moved
};

/// A selection of fields of the status by their paths, such as "mode" and "loop.rateHz".
class StatusFields {
 public:
  /// Selects the whole status.
  StatusFields() = default;
  /// Errors: a reply io.hapticd.Status.UnknownField with the first unknown path.
  static std::expected<StatusFields, Reply> from(std::span<const std::string> paths);

  /// The selected fields of `status`, nested as there. If an object is null, its fields are shown by that
  /// null.
  OrderedJson of(const OrderedJson& status) const;

 private:
  using Path = std::vector<std::string>;

  bool all_ = true;
  std::vector<Path> paths_;
};

/// The method GetStatus and the streams of Monitor.
/// Thread: control thread only.
class MonitorStreams {
 public:
  explicit MonitorStreams(Box& box) : box_(box) {}
  std::vector<Method> methods();

  void onTick(const rt::Tick& tick);
  void feed(Replies& replies);
  void closed(ConnectionId connection);

 private:
  using Clock = std::chrono::steady_clock;

  struct Stream {
    ConnectionId connection = 0;
    Clock::duration interval{};
    Clock::time_point due;
    StatusFields fields;
    TickWindow window = {};
    std::uint64_t dropped = 0;
  };

  Answer getStatus(const Call&, const Caller&);
  void monitor(const Call&, const Caller&, Replies&);
  static void offer(Stream& stream, const OrderedJson& status, Replies& replies);

  Box& box_;
  std::vector<Stream> streams_;
};

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
