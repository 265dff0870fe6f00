// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <vector>

#include "daemon/base/box.h"
#include "daemon/control/method.h"
#include "daemon/control/status_fields.h"
#include "daemon/control/tick_window.h"

namespace hapticd::daemon {

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

  void getStatus(const Call&, const Caller&, Replies&);
  void monitor(const Call&, const Caller&, Replies&);
  static void offer(Stream& stream, const OrderedJson& status, Replies& replies);

  Box& box_;
  std::vector<Stream> streams_;
};

}  // namespace hapticd::daemon
