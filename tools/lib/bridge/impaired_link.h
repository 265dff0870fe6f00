// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <random>
#include <span>
#include <vector>

namespace hapticd::tools {

/// The impairments of a network, which apply to each direction separately.
struct Impairments {
  double delay_ms = 0;   ///< for every packet
  double loss = 0;       ///< probabilities, 0..1
  double duplicate = 0;  ///< arrives twice
  double reorder = 0;    ///< is delayed until others have overtaken it
  double corrupt = 0;    ///< one bit is wrong
  std::uint64_t seed = 1;
};

/// One direction of a network that loses, duplicates, reorders and damages packets. The same seed and the
/// same packets give the same impairments. Thread: one.
class ImpairedLink {
 public:
  using Packet = std::vector<std::byte>;

  /// `direction`: 0 or 1, so that the two directions are impaired differently.
  ImpairedLink(const Impairments& impairments, std::uint64_t direction)
      : impairments_(impairments), random_(impairments.seed * 2 + direction) {}

  void push(std::span<const std::byte> bytes, std::int64_t now_ns);
  /// The next packet that has arrived by now; nothing: there is none.
  std::optional<Packet> pop(std::int64_t now_ns);

 private:
  bool happens(double probability) {
    return probability > 0 && std::uniform_real_distribution<double>()(random_) < probability;
  }

  Impairments impairments_;
  std::mt19937_64 random_;
  std::multimap<std::int64_t, Packet>
      under_way_;  // by time of arrival; in order of sending where it is the same
};

}  // namespace hapticd::tools
