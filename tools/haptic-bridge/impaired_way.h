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

/// How bad the network is to be, each way.
struct Impairments {
  double delay_ms = 0;   ///< for every packet
  double loss = 0;       ///< probabilities, 0..1
  double duplicate = 0;  ///< comes twice
  double reorder = 0;    ///< is held up until others have passed it
  double corrupt = 0;    ///< one bit is wrong
  std::uint64_t seed = 1;
};

/// One way of a network that loses, doubles, holds up and damages packets. The same seed and the same packets
/// give the same accidents.
/// Thread: one.
class ImpairedWay {
 public:
  using Packet = std::vector<std::byte>;

  /// `way`: another number for the other way, so that its accidents are others.
  ImpairedWay(const Impairments& impairments, std::uint64_t way)
      : impairments_(impairments), random_(impairments.seed * 2 + way) {}

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
