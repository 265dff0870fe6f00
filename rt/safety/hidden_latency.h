// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

#include "rt/base/realtime_safe.h"
#include "rt/base/vec3.h"
#include "rt/channels/handle_channel.h"
#include "rt/safety/latency_probe.h"

namespace hapticd::rt {

/// Decides when the latency of a device is measured, and keeps what its driver cannot tell: once in each
/// session of a device that asks for it (HandleState::probes), when the force may act first; a measurement
/// that is not conclusive is tried again twice.  Thread: one.  RT: safe.
class HiddenLatency {
 public:
  static constexpr int kMaxTries = 3;

  struct Input {
    const HandleState& handle;
    bool engaged = false;     ///< the force may act
    double motion_scale = 1;  ///< of the HIP's displacement to the hand's
    Vec3 command_n_in_world;  ///< of the previous tick, at the hand
    double period_s = 0;
  };

  /// Runs a tick. Returns the force of the knock at the hand; zero while nothing is measured.
  Vec3 step(const Input& input) HAPTICD_RT {
    if (!input.handle.probes) return {};
    if (input.handle.session != session_) {
      session_ = input.handle.session;
      tries_left_ = kMaxTries;
      hidden_s_ = 0;
      probe_.stop();
    }
    if (!input.engaged) {
      probe_.stop();
      return {};
    }
    if (!probe_.isRunning()) {
      if (tries_left_ == 0) return {};
      --tries_left_;
      probe_.start();
    }
    const std::uint32_t before = probe_.result().number;
    const double force_n =
        probe_.step({.position_m = dot(input.handle.position_m_in_world, kDirection) / input.motion_scale,
                     .command_n = dot(input.command_n_in_world, kDirection),
                     .period_s = input.period_s});
    if (const LatencyProbe::Result& result = probe_.result(); result.number != before && result.conclusive) {
      tries_left_ = 0;
      hidden_s_ = std::max(0.0, result.latency_s - std::max(0.0, input.handle.delay_s));
    }
    return force_n * kDirection;
  }

  /// Time by which forces act later than the device says; 0: not at all, or not known.
  double hidden_s() const noexcept { return hidden_s_; }
  /// From a motion of the hand to the force that responds to it, without the loop's own share: what the
  /// device says, and what it does not.
  double delay_s(const HandleState& handle) const noexcept {
    return std::max(0.0, handle.delay_s) + hidden_s_;
  }
  /// Of the newest measurement.
  const LatencyProbe::Result& result() const noexcept { return probe_.result(); }

 private:
  static constexpr Vec3 kDirection{1, 0, 0};

  LatencyProbe probe_;
  std::uint64_t session_ = 0;  ///< of the device whose latency has been measured, or is being; 0: none
  int tries_left_ = 0;
  double hidden_s_ = 0;
};

}  // namespace hapticd::rt
