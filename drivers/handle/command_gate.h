// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "rt/handle_channel.h"
#include "rt/latency_histogram.h"
#include "rt/vec3.h"

namespace hapticd::drivers {

/// What every driver asks before it exerts a command, and what measures how long commands take to it.
///
/// A command may be exerted while it is younger than kLifeNs, by the clock that it was written at: beyond
/// that the force loop stands. And only in the session of the device whose measurement it answers: what was
/// computed for a device before it was lost, or before it found its origin, is never exerted after that.
/// Thread: the driver's; lastHop() any.  Progress: wait-free.  RT: safe.
class CommandGate {
 public:
  static constexpr std::int64_t kLifeNs = 20'000'000;

  /// The force of the newest command, newtons in the world's axes; nothing: none may be exerted. `session`:
  /// of the device (rt::HandleState::session), `now_ns`: CLOCK_MONOTONIC.
  std::optional<rt::Vec3> pass(const rt::HandleCommand& newest, std::uint64_t session, std::int64_t now_ns) {
    const bool may_pass = newest.tick != 0 && newest.session == session && now_ns - newest.time_ns <= kLifeNs;
    passed_ = may_pass ? newest : rt::HandleCommand{};
    return may_pass ? std::optional(newest.force_n_in_world) : std::nullopt;
  }

  /// What pass() gave last has been handed to the device. Counted once for each command.
  void sent(std::int64_t now_ns) {
    if (passed_.tick == 0 || passed_.time_ns == sent_.time_ns) return;
    latency_ns_ = now_ns - waitingSince_ns();
    sent_ = passed_;
    last_hop_.add(latency_ns_);
  }

  /// Of the newest sending, how long a command had waited for it, from its writing by the force thread; where
  /// the driver left commands out for a newer one, the first of these. 0: none has been sent.
  std::int64_t latency_ns() const { return latency_ns_; }

  /// Over all sendings; nothing while there is none.
  std::optional<rt::LatencySummary> lastHop() const {
    return last_hop_.total() == 0 ? std::nullopt : std::optional(summaryOf(last_hop_));
  }

 private:
  /// When the command was written that follows the one sent before: the ticks between are alike.
  std::int64_t waitingSince_ns() const {
    const bool follows = sent_.tick != 0 && sent_.session == passed_.session && passed_.tick > sent_.tick;
    if (!follows) return passed_.time_ns;
    const auto ticks = static_cast<std::int64_t>(passed_.tick - sent_.tick);
    return sent_.time_ns + (passed_.time_ns - sent_.time_ns) / ticks;
  }

  rt::HandleCommand passed_;  // tick 0: none
  rt::HandleCommand sent_;    // likewise
  std::int64_t latency_ns_ = 0;
  rt::LatencyHistogram last_hop_;
};

}  // namespace hapticd::drivers
