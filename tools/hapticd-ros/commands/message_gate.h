// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "config/base/rate_limit.h"

namespace hapticd::tools::ros {

/// What is known of a message from the network beside its content.
struct MessageHead {
  std::uint64_t publisher = 0;
  std::int64_t stamp_utc_ns = 0;  ///< of its header; 0: none
  std::int64_t sent_utc_ns = 0;   ///< when it was handed to DDS
  std::string frame = {};

  /// When it was made, as far as its sender tells.
  std::int64_t made_utc_ns() const noexcept { return stamp_utc_ns != 0 ? stamp_utc_ns : sent_utc_ns; }
};

/// What the messages of a topic must be like.
struct GateRules {
  int most_per_second = 0;
  std::chrono::nanoseconds oldest{};
  /// Only one at a time: the first whose message was used, until it is silent for MessageGate::kSilence.
  bool one_publisher = false;
  std::string frame = {};  ///< the only frame_id; empty: any
};

/// Decides which messages of a topic are taken.
/// Thread: one.
class MessageGate {
 public:
  static constexpr std::chrono::seconds kSilence{1};
  /// Clocks of two computers that are synchronised differ by less.
  static constexpr std::chrono::milliseconds kEarliest{5};

  explicit MessageGate(GateRules rules) : rules_(std::move(rules)), rate_(rules_.most_per_second) {}

  /// Returns why a message is refused, and what to do; nothing: its content may be used.
  /// utc_ns: now. time: now, not earlier than at the last call.
  std::optional<std::string> refusal(const MessageHead& head, std::int64_t utc_ns,
                                     std::chrono::steady_clock::time_point time);
  /// Notes that the content of a message was valid and is used.
  void used(const MessageHead& head, std::chrono::steady_clock::time_point time);

 private:
  using Time = std::chrono::steady_clock::time_point;

  std::optional<std::string> refusalByAge(const MessageHead& head, std::int64_t utc_ns) const;

  GateRules rules_;
  base::RateLimit rate_;
  std::uint64_t publisher_ = 0;  // of the newest that was used
  Time newest_;                  // of this publisher
};

}  // namespace hapticd::tools::ros
