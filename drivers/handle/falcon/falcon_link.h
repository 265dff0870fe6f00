// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "config/error.h"
#include "drivers/handle/falcon/falcon_packet.h"
#include "drivers/handle/falcon/ftdi_port.h"

namespace hapticd::drivers {

/// Orders out, replies in: the firmware answers each order, and says nothing by itself.
/// Thread: the port's.  RT: not safe.
class FalconLink {
 public:
  /// Replies take about 1 ms, the latency timer's; one that takes this long is lost.
  static constexpr std::chrono::milliseconds kReplyLimit{10};

  explicit FalconLink(FtdiPort& port) : port_(port) {}

  /// The speed of the firmware, replies without delay, and nothing left of before.
  config::Result<void> begin();

  /// Errors: the device is gone.
  config::Result<void> send(const FalconOrder& order);

  /// Waits for the reply to the order sent last; nothing where none came within kReplyLimit that was whole.
  /// Errors: the device is gone.
  config::Result<std::optional<FalconReply>> receive();

  /// How often something came that was no reply.
  std::uint64_t damaged() const { return replies_.damaged(); }

 private:
  FtdiPort& port_;
  FalconReplyStream replies_;
};

}  // namespace hapticd::drivers
