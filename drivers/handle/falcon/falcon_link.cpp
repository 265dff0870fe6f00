// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/falcon/falcon_link.h"

namespace hapticd::drivers {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kSendLimit{100};
constexpr std::uint16_t kLatencyMs = 1;
constexpr std::chrono::milliseconds kLastRead{2 * kLatencyMs};

}  // namespace

base::Result<void> FalconLink::begin() {
  replies_.reset();
  if (auto done = port_.setLatency(kLatencyMs); !done) return done;
  if (auto done = port_.setBaud(FtdiPort::Baud::of_firmware); !done) return done;
  return port_.purge();
}

base::Result<void> FalconLink::send(const FalconOrder& order) {
  return port_.write(frameOf(order), kSendLimit);
}

base::Result<std::optional<FalconReply>> FalconLink::receive() {
  const Clock::time_point deadline = Clock::now() + kReplyLimit;
  std::optional<FalconReply> newest;
  for (bool late = false; !newest && !late;) {
    late = Clock::now() >= deadline;  // one more read: the reply may have come while this thread had no CPU
    const auto bytes = port_.read(late ? kLastRead : kReplyLimit);
    if (!bytes) return std::unexpected(bytes.error());
    for (const std::uint8_t byte : *bytes) {
      if (const auto reply = replies_.add(byte)) newest = reply;
    }
  }
  if (newest) return newest;
  // A late reply would be mistaken for the reply to the next order.
  replies_.reset();
  if (auto purged = port_.purge(); !purged) return std::unexpected(purged.error());
  return std::nullopt;
}

}  // namespace hapticd::drivers
