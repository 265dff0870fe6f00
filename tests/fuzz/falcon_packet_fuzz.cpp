// SPDX-License-Identifier: Apache-2.0
// Data sent by a device at the Falcon's USB address: for any data, replies are within their ranges and lead
// to no force or position that is not finite or beyond the device's limits.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/handle/falcon/falcon_arm.h"
#include "tests/fuzz/seeds.h"

namespace {

using namespace hapticd;

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

constexpr unsigned kAll = drivers::kAllHomed;
constexpr drivers::FalconCounts kWithinReach{200, -150, 90};

/// A frame as the device sends it, with any 16 bits for each encoder.
std::string replyOf(const drivers::FalconCounts& counts, unsigned homed, unsigned buttons = 0) {
  std::string frame = "<";
  for (const int count : counts) {
    for (unsigned shift = 0; shift < 16; shift += 4)
      frame.push_back(static_cast<char>('A' + ((static_cast<unsigned>(count) >> shift) & 0xFU)));
  }
  frame.push_back(static_cast<char>('A' + (homed << 4U | buttons)));
  return frame + "A>";
}

std::string repeated(int times, const std::string& text) {
  std::string all;
  for (int i = 0; i < times; ++i) all += text;
  return all;
}

/// The bytes of a stream as the FTDI chip transfers them: each packet of 64 bytes begins with two of status.
std::string transferred(bool homed, std::size_t transfer_bytes, const std::string& stream) {
  std::string input(1, static_cast<char>(2 * (transfer_bytes - 1) + (homed ? 1 : 0)));
  for (std::size_t sent = 0; sent < stream.size();) {
    const std::size_t carried = std::min<std::size_t>(transfer_bytes, 64) - 2;
    input += "\x01\x60" + stream.substr(sent, carried);
    sent += carried;
  }
  return input;
}

}  // namespace

std::vector<std::string> seeds() {
  const std::string reply = replyOf(kWithinReach, kAll);
  const std::string not_homed = replyOf({}, 0);
  return {
      transferred(false, 64, not_homed),
      transferred(false, 64, repeated(12, replyOf({}, 3)) + repeated(12, reply)),  // becomes homed
      transferred(true, 18, repeated(3, reply) + repeated(12, not_homed)),         // homing is lost
      transferred(true, 64, repeated(9, not_homed) + reply + not_homed),  // one contrary reply of ten
      transferred(true, 64, replyOf({}, kAll, 0xF)),
      transferred(true, 18, replyOf({-1447, 1447, 0}, kAll)),
      transferred(true, 18, replyOf({32767, -32768, 1}, kAll) + reply),  // out of reach, and back
      transferred(true, 18, replyOf({-900, -900, -900}, kAll) + replyOf({900, 900, 900}, kAll)),
      transferred(true, 128, repeated(12, reply)),                     // two packets in a transfer
      transferred(true, 3, reply),                                     // a byte in each transfer
      transferred(true, 64, reply.substr(0, 7) + repeated(2, reply)),  // bytes are missing
      transferred(true, 64, reply.substr(0, 13) + reply),        // a frame begins where any byte may stand
      transferred(true, 64, reply.substr(0, 15) + "?" + reply),  // does not end
      transferred(true, 64, "noise<" + reply + ">>AA<<" + reply),
      transferred(true, 64, reply.substr(0, 14) + "<" + reply.substr(1)),
      std::string(5, '\x02'),               // status bytes only
      "\x7E" + repeated(20, "PP<PPPPPPP"),  // no status bytes
  };
}

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
