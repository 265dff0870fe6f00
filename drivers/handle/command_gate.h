// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "rt/base/latency_histogram.h"
#include "rt/base/vec3.h"
#include "rt/channels/handle_channel.h"

namespace hapticd::drivers {

/// Check that every driver makes before it exerts a command, and measurement of the command latency.
///
/// A command may be exerted while it is younger than rt::kCommandLife_ns by the clock that it was written
/// with; an older one means that the force loop has stalled. It is also valid only in the device session of
/// the measurement that it responds to: a command computed before the device was lost, or before it found its
/// origin, is never exerted afterwards. Thread: the driver's; lastHop() any.  Progress: wait-free.  RT: safe.
class CommandGate {
 public:
  /// Returns the force of the newest command in newtons, in world axes, or nothing if none may be exerted.
  /// `session`: current session of the device (rt::HandleState::session); `now_ns`: CLOCK_MONOTONIC.
  std::optional<rt::Vec3> pass(const rt::HandleCommand& newest, std::uint64_t session, std::int64_t now_ns) {
    const bool may_pass =
        newest.tick != 0 && newest.session == session && now_ns - newest.time_ns <= rt::kCommandLife_ns;
    passed_ = may_pass ? newest : rt::HandleCommand{};
    return may_pass ? std::optional(newest.force_n_in_world) : std::nullopt;
  }

  /// Records that the last result of pass() was sent to the device. Counts each command once.
  void sent(std::int64_t now_ns) {
    if (passed_.tick == 0 || passed_.time_ns == sent_.time_ns) return;
    latency_ns_ = now_ns - waitingSince_ns();
    sent_ = passed_;
    last_hop_.add(latency_ns_);
  }

  /// Returns how long the most recently sent command had waited since the force thread wrote it; if the
  /// driver skipped commands for a newer one, since the first of these was written. 0: none sent yet.
  std::int64_t latency_ns() const { return latency_ns_; }

  /// Returns the distribution over all commands sent; nothing if there is none.
  std::optional<rt::LatencySummary> lastHop() const {
    return last_hop_.total() == 0 ? std::nullopt : std::optional(summaryOf(last_hop_));
  }

 private:
  /// Returns when the command after the previously sent one was written; ticks are equally spaced.
  std::int64_t waitingSince_ns() const {
    const bool follows = sent_.tick != 0 && sent_.session == passed_.session && passed_.tick > sent_.tick;
    if (!follows) return passed_.time_ns;
    const auto ticks = static_cast<std::int64_t>(passed_.tick - sent_.tick);
    return sent_.time_ns + (passed_.time_ns - sent_.time_ns) / ticks;
  }

  rt::HandleCommand passed_;  // tick 0: none
  rt::HandleCommand sent_;    // tick 0: none
  std::int64_t latency_ns_ = 0;
  rt::LatencyHistogram last_hop_;
};

}  // namespace hapticd::drivers
