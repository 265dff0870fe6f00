// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/kinect/stream_faults.h"

#include <algorithm>

namespace hapticd::test {
namespace {

constexpr std::size_t kFirstLost = 100;  // or earlier, where so many are lost
constexpr std::size_t kShort = 50;
// Less often than once per frame, so that some frames stay whole; a prime, so that the place changes.
constexpr std::uint64_t kGarbageEach = 401;

}  // namespace

void StreamFaults::clear() {
  lose_next_ = 0;
  garbage_ = short_ = false;
  since_garbage_ = 0;
}

std::size_t StreamFaults::apply(std::size_t index, std::span<std::uint8_t> packet) noexcept {
  const std::size_t first = std::min(kFirstLost, kinect::kPacketsPerFrame - lose_now_);
  if (index >= first && index < first + lose_now_) return 0;
  if (garbage_ && ++since_garbage_ % kGarbageEach == 0) spoilHeader(packet.first(kinect::kPacketHeaderBytes));
  return short_ && index == kShort ? packet.size() / 2 : packet.size();
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
