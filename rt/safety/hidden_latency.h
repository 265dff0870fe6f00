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
/// session of a device that asks for it (HandleState::probes), when the force may act first. A measurement
/// that is not conclusive is tried again twice at once. Then the longest latency that could have been found
/// counts until one is conclusive, and every few seconds another is made.  Thread: one.  RT: safe.
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
      tries_ = 0;
      found_ = false;
      hidden_s_ = 0;
      probe_.stop();
    }
    if (!input.engaged) {
      probe_.stop();
      wait_s_ = 0;
    }
    wait_s_ -= input.period_s;
    if (!input.engaged || (!probe_.isRunning() && (found_ || wait_s_ > 0))) return {};
    if (!probe_.isRunning()) {
      ++tries_;
      probe_.start();
    }
    const std::uint32_t before = probe_.result().number;
    const double force_n =
        probe_.step({.position_m = dot(input.handle.position_m_in_world, kDirection) / input.motion_scale,
                     .command_n = dot(input.command_n_in_world, kDirection),
                     .period_s = input.period_s});
    if (probe_.result().number != before) conclude(input);
    return force_n * kDirection;
  }

  /// Time by which forces act later than the device says; 0: not at all, or not measured yet.
  double hidden_s() const noexcept { return hidden_s_; }
  /// From a motion of the hand to the force that responds to it, without the loop's own share: what the
  /// device says, and what it does not.
  double delay_s(const HandleState& handle) const noexcept {
    return std::max(0.0, handle.delay_s) + hidden_s_;
  }
  /// Returns the mass that the rules of stability are to assume of the device: the configured one, unless
  /// device and hand together moved like a clearly lighter one.
  double deviceMass_kg(double configured_kg) const noexcept {
    return found_ && isLighter(probe_.result(), configured_kg) ? probe_.result().mass_kg : configured_kg;
  }
  /// Whether device and hand moved like a device that is clearly lighter than configured: the measurement is
  /// within 15 %.
  static bool isLighter(const LatencyProbe::Result& measured, double configured_kg) noexcept {
    constexpr double kClearly = 0.8;
    return measured.conclusive && measured.mass_kg < kClearly * configured_kg;
  }
  /// Of the newest measurement.
  const LatencyProbe::Result& result() const noexcept { return probe_.result(); }

 private:
  static constexpr Vec3 kDirection{1, 0, 0};
  /// Between measurements once the first ones have found nothing.
  static constexpr double kPause_s = 5;

  void conclude(const Input& input) HAPTICD_RT {
    const LatencyProbe::Result& result = probe_.result();
    found_ = result.conclusive;
    if (!found_ && tries_ < kMaxTries) return;
    wait_s_ = kPause_s;
    const double latency_s =
        found_ ? result.latency_s : static_cast<double>(LatencyProbe::kMaxLatency_ticks) * input.period_s;
    hidden_s_ = std::max(0.0, latency_s - std::max(0.0, input.handle.delay_s));
  }

  LatencyProbe probe_;
  std::uint64_t session_ = 0;  ///< of the device whose latency has been measured, or is being; 0: none
  int tries_ = 0;
  bool found_ = false;  ///< a measurement of this session was conclusive
  double wait_s_ = 0;   ///< until the next measurement
  double hidden_s_ = 0;
};

}  // namespace hapticd::rt
