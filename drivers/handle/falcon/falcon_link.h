// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "config/base/error.h"
#include "drivers/handle/falcon/falcon_packet.h"
#include "drivers/handle/falcon/ftdi_port.h"

namespace hapticd::drivers {

/// Exchanges orders and replies with the firmware, which replies to each order and sends nothing else.
/// Thread: the port's.  RT: not safe.
class FalconLink {
 public:
  /// A reply takes about 1 ms because of the latency timer; after this time it counts as lost.
  static constexpr std::chrono::milliseconds kReplyLimit{10};

  explicit FalconLink(FtdiPort& port) : port_(port) {}

  /// Sets the firmware's baud rate and the shortest latency, and discards pending bytes.
  base::Result<void> begin();

  /// Sends an order.  Errors: the device is gone.
  base::Result<void> send(const FalconOrder& order);

  /// Waits for the reply to the last order; nothing if no complete reply has arrived by a last read after
  /// kReplyLimit.
  /// Errors: the device is gone.
  base::Result<std::optional<FalconReply>> receive();

  /// Returns how often invalid data was received.
  std::uint64_t damaged() const { return replies_.damaged(); }

 private:
  FtdiPort& port_;
  FalconReplyStream replies_;
};

}  // namespace hapticd::drivers
