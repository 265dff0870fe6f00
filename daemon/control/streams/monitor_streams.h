// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <expected>
#include <span>
#include <string>
#include <vector>

#include "daemon/base/box.h"
#include "daemon/control/base/method_context.h"
#include "daemon/control/base/tick_window.h"
#include "daemon/control/server/varlink_message.h"

namespace hapticd::daemon {

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

}  // namespace hapticd::daemon
