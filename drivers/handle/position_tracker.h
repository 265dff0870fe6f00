// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

#include "rt/base/vec3.h"

namespace hapticd::drivers {

/// Interpolates a position that a device measures in steps, such as those of an encoder, per axis. The true
/// position is within half a step of the measured one. The tracker moves on at constant velocity as long as
/// it is there too; where it would leave that interval it stays at its end and corrects the velocity. A
/// position at rest between two steps therefore does not jump to and fro, and one that moves steadily changes
/// steadily rather than in steps, whose frequency a hand feels: steps of 50 um at 500 N/m are 25 mN.
///
/// The result is never farther than half a step from the measured position, so it is off the true one by at
/// most a step, and not late by more than the time in which the hand moves by a step.
///
/// Thread: one.  Progress: wait-free.  RT: safe.
class PositionTracker {
 public:
  /// `step_m`: 0 or above; 0: the position is exact.
  explicit PositionTracker(double step_m) : half_step_m_(0.5 * step_m) {}

  /// Adds a measurement and returns the position at `time_ns`.
  rt::Vec3 add(const rt::Vec3& position_m, std::int64_t time_ns) {
    const std::int64_t gap_ns = time_ns - time_ns_;
    const bool goes_on = started_ && gap_ns > 0 && gap_ns <= kMaxGapNs;
    if (!goes_on) {
      position_m_ = position_m;
      velocity_m_per_s_ = {};
    } else {
      const double period_s = static_cast<double>(gap_ns) * 1e-9;
      for (double rt::Vec3::*axis : {&rt::Vec3::x, &rt::Vec3::y, &rt::Vec3::z})
        advance(position_m_.*axis, velocity_m_per_s_.*axis, position_m.*axis, period_s);
    }
    started_ = true;
    time_ns_ = time_ns;
    return position_m_;
  }

  /// Forgets what came before.
  void reset() { started_ = false; }

 private:
  /// Measurements farther apart are not connected: the device paused.
  static constexpr std::int64_t kMaxGapNs = 50'000'000;
  /// Share of a correction that goes into the velocity.
  static constexpr double kGain = 0.2;

  void advance(double& position_m, double& velocity_m_per_s, double measured_m, double period_s) const {
    const double expected_m = position_m + velocity_m_per_s * period_s;
    position_m = std::clamp(expected_m, measured_m - half_step_m_, measured_m + half_step_m_);
    velocity_m_per_s += kGain * (position_m - expected_m) / period_s;
  }

  double half_step_m_;
  bool started_ = false;
  std::int64_t time_ns_ = 0;
  rt::Vec3 position_m_;
  rt::Vec3 velocity_m_per_s_;
};

}  // namespace hapticd::drivers
