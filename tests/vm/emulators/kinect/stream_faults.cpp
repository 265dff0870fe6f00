// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/kinect/stream_faults.h"

#include <algorithm>
#include <utility>

namespace hapticd::test {
namespace {

constexpr std::size_t kFirstLost = 100;  // or earlier, where so many are lost
constexpr std::size_t kShort = 50;
// Less often than once per frame, so that some frames stay whole; a prime, so that the place changes.
constexpr std::uint64_t kGarbageEach = 401;

}  // namespace

void StreamFaults::lose(std::size_t packets, bool once) {
  lose_once_ = once ? packets : 0;
  lose_always_ = once ? lose_always_ : packets;
}

void StreamFaults::clear() {
  lose_always_ = lose_once_ = 0;
  garbage_ = short_ = false;
  since_garbage_ = 0;
}

void StreamFaults::beginFrame() {
  const std::size_t once = std::exchange(lose_once_, 0);
  lose_now_ = once != 0 ? once : lose_always_;
}

std::size_t StreamFaults::apply(std::size_t index, std::span<std::uint8_t> packet) noexcept {
  const std::size_t first = std::min(kFirstLost, kinect::kPacketsPerFrame - lose_now_);
  if (index >= first && index < first + lose_now_) {
    ++lost_packets_;
    return 0;
  }
  if (garbage_ && ++since_garbage_ % kGarbageEach == 0) spoilHeader(packet.first(kinect::kPacketHeaderBytes));
  if (!short_ || index != kShort) return packet.size();
  ++short_packets_;
  return packet.size() / 2;
}

/// Every second header keeps its magic, so that a receiver looks at the rest.
void StreamFaults::spoilHeader(std::span<std::uint8_t> header) noexcept {
  constexpr std::size_t kMagicBytes = 2;
  const std::size_t kept = garbage_packets_++ % 2 == 0 ? 0 : kMagicBytes;
  for (std::uint8_t& byte : header.subspan(kept)) byte = randomByte();
}

/// xorshift32
std::uint8_t StreamFaults::randomByte() noexcept {
  random_ ^= random_ << 13;
  random_ ^= random_ >> 17;
  random_ ^= random_ << 5;
  return static_cast<std::uint8_t>(random_ >> 24);
}

}  // namespace hapticd::test
