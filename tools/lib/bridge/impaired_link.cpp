// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/bridge/impaired_link.h"

#include <cmath>
#include <utility>

namespace hapticd::tools {
namespace {

constexpr std::int64_t kHeldUpNs = 3'000'000;  // two or three packets pass at 1 kHz

}  // namespace

void ImpairedLink::push(std::span<const std::byte> bytes, std::int64_t now_ns) {
  if (happens(impairments_.loss)) return;
  Packet packet(bytes.begin(), bytes.end());
  if (!packet.empty() && happens(impairments_.corrupt)) {
    const std::size_t bit = random_() % (packet.size() * 8);
    packet[bit / 8] ^= std::byte{1} << (bit % 8);
  }
  std::int64_t arrives_ns = now_ns + std::llround(impairments_.delay_ms * 1e6);
  if (happens(impairments_.reorder)) arrives_ns += kHeldUpNs;
  if (happens(impairments_.duplicate)) under_way_.emplace(arrives_ns, packet);
  under_way_.emplace(arrives_ns, std::move(packet));
}

std::optional<ImpairedLink::Packet> ImpairedLink::pop(std::int64_t now_ns) {
  if (under_way_.empty() || under_way_.begin()->first > now_ns) return std::nullopt;
  return std::move(under_way_.extract(under_way_.begin()).mapped());
}

}  // namespace hapticd::tools
