// SPDX-License-Identifier: Apache-2.0
// Data sent by a device at the Falcon's USB address: for any data, replies are within their ranges and lead
// to no force or position that is not finite or beyond the device's limits.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "drivers/handle/falcon/falcon_packet.h"
#include "drivers/handle/falcon/falcon_tracker.h"

namespace {

using namespace hapticd;

void require(bool holds) {
  if (!holds) std::abort();
}

void requireWithinLimits(drivers::FalconTracker& tracker) {
  if (tracker.pose()) {
    const rt::Vec3& p = tracker.pose()->position_m;
    require(rt::isFinite(p) && std::hypot(p.x, p.y) <= drivers::kFalconReachFromAxis_m);
    require(p.z >= drivers::kFalconNearest_m && p.z <= drivers::kFalconFarthest_m);
  }
  const drivers::FalconOrder order = tracker.orderFor(rt::Vec3{3, -40, 1000});
  for (const int counts : order.motor_counts) {
    require(std::abs(counts) <= drivers::kMaxMotorCounts);
    require(tracker.homed() || counts == 0);
  }
}

}  // namespace

/// The first byte: whether the device is homed already, and the length of the transfers; the rest is their
/// content.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const std::size_t transfer_bytes = std::size_t{data[0]} / 2 + 1;
  std::span<const std::uint8_t> rest(data + 1, size - 1);
  drivers::FalconReplyStream replies;
  drivers::FalconTracker tracker(1);
  for (int i = 0; i < drivers::FalconTracker::kSteadyReplies && data[0] % 2 == 1; ++i) {
    tracker.take({{}, 0, drivers::kAllHomed});
  }
  while (!rest.empty()) {
    const std::size_t length = std::min(transfer_bytes, rest.size());
    std::vector<std::uint8_t> transfer(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(length));
    rest = rest.subspan(length);
    transfer.resize(drivers::removeStatusBytes(transfer));
    for (const std::uint8_t byte : transfer) {
      const auto reply = replies.add(byte);
      if (!reply) continue;
      for (const int counts : reply->encoder_counts) require(counts >= -32768 && counts <= 32767);
      require(reply->homed <= drivers::kAllHomed && reply->buttons <= 0xF);
      tracker.take(*reply);
      requireWithinLimits(tracker);
    }
  }
  return 0;
}
