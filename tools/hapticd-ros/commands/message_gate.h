// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

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
  bool one_publisher = false;  ///< only one at a time, until it has been silent for MessageGate::kSilence
  std::string frame = {};      ///< the only frame_id; empty: any
};

/// Decides which messages of a topic are taken.
/// Thread: one.
class MessageGate {
 public:
  static constexpr std::chrono::seconds kSilence{1};
  /// Clocks of two computers that are synchronised differ by less.
  static constexpr std::chrono::milliseconds kEarliest{5};

  explicit MessageGate(GateRules rules) : rules_(std::move(rules)) {}

  /// Returns why a message is refused, and what to do; nothing: it is taken.
  /// utc_ns: now. time: now, not earlier than at the last call.
  std::optional<std::string> refusal(const MessageHead& head, std::int64_t utc_ns,
                                     std::chrono::steady_clock::time_point time);

 private:
  using Time = std::chrono::steady_clock::time_point;

  std::optional<std::string> refusalByAge(const MessageHead& head, std::int64_t utc_ns) const;

  GateRules rules_;
  Time second_;  // begin of the second in which is counted
  int count_ = 0;
  std::uint64_t publisher_ = 0;  // of the newest that was taken
  Time newest_;
};

}  // namespace hapticd::tools::ros
