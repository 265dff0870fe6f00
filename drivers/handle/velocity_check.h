// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/vec3.h"

namespace hapticd::drivers {

/// Compares the velocity that a device claims with the displacement of its position. A velocity in another
/// unit, of the other sign, stuck, or noisy is contradicted after some 10 ms of motion, or at once where it
/// claims motion at rest.
///
/// The claimed displacement less the measured one, summed up over about kWindow_s, is the error. A device
/// that filters its velocity with a delay d is off by up to d times its speed, and one whose velocity is
/// scaled by 1 + s by s kWindow_s times its speed. So the velocity is contradicted where the error exceeds
/// kTolerance_m and kTolerance_s times the largest speed of the last while: filters of up to 20 ms and scales
/// within 20 % pass. Thread: one.  Progress: wait-free.  RT: safe.
class VelocityCheck {
 public:
  static constexpr double kWindow_s = 0.1;
  static constexpr double kTolerance_m = 0.0005;
  static constexpr double kTolerance_s = 0.02;
  /// Measurements farther apart are not compared: the device paused.
  static constexpr std::int64_t kLongestGapNs = 50'000'000;

  /// Adds a measurement, all in the device's frame. `estimated_m_per_s`: the velocity by the positions alone.
  /// Returns whether the claimed velocity is contradicted.
  bool add(const rt::Vec3& position_m, std::int64_t time_ns, const rt::Vec3& claimed_m_per_s,
           const rt::Vec3& estimated_m_per_s);

  /// Forgets what came before.
  void reset() { *this = {}; }

 private:
  bool started_ = false;
  std::int64_t time_ns_ = 0;
  rt::Vec3 position_m_;
  rt::Vec3 claimed_m_per_s_;
  rt::Vec3 error_m_;
  double speed_m_per_s_ = 0;  ///< largest of the last while
};

}  // namespace hapticd::drivers
