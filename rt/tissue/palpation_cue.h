// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/base/parameters.h"
#include "rt/base/realtime_safe.h"
#include "rt/base/vec3.h"

namespace hapticd::rt {

/// A vibration along the surface that marks a region under the HIP: A sin(2 pi f t) in newtons at the hand.
/// Its direction is that of the HIP's motion and turns slowly, so that the force does not step.
/// Thread: one.  Progress: wait-free.  RT: safe.
class PalpationCue {
 public:
  static constexpr double kMaxForce_n = 0.3;
  /// Largest amplitude as a share of the contact force.
  static constexpr double kMaxShare = 0.3;
  /// Largest share of the slew limit.
  static constexpr double kSlewShare = 0.25;
  /// Time in which the amplitude passes between 0 and kMaxForce_n.
  static constexpr double kRamp_s = 0.02;
  static constexpr double kMaxFrequency_hz = 250;
  /// Slower motion along the surface does not turn the vibration.
  static constexpr double kMinSpeed_m_per_s = 0.005;

  struct Input {
    bool allowed = false;    ///< the mode is `engaged` and the HIP in contact
    double amplitude_n = 0;  ///< requested, >= 0
    double frequency_hz = 0;
    double contact_force_n = 0;        ///< at the hand
    Vec3 normal_in_world{};            ///< of the surface; zero: not known at this tick
    Vec3 velocity_m_per_s_in_world{};  ///< of the HIP
    double period_s;
  };

  /// Returns the force of this tick.
  Vec3 apply(const Input& input, const SafetyParameters& parameters) HAPTICD_RT;

 private:
  void turn(const Input& input) HAPTICD_RT;

  double amplitude_n_ = 0;
  double phase_rad_ = 0;
  double frequency_hz_ = 0;  ///< of the last region that had a cue
  Vec3 direction_;           ///< unit vector; zero: none yet
};

}  // namespace hapticd::rt
