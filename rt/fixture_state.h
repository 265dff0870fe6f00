// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>

#include "rt/realtime_safe.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// Time that the HIP spent inside a forbidden region. It ends when the HIP has been outside for half a
/// second, so that a hand that taps the region counts once.
struct Breach {
  std::uint64_t number = 0;     ///< of those of this fixture that have ended; 0: none has
  std::int64_t entered_ns = 0;  ///< CLOCK_MONOTONIC
  Vec3 entered_m_in_world;      ///< where the HIP was then
  double duration_s = 0;        ///< until the HIP was outside
  double depth_m = 0;           ///< largest
};

/// What one fixture does.
struct FixtureState {
  /// Of the HIP from the boundary, negative inside a forbidden region; of guidance from path or point; not a
  /// number: not known.
  double distance_m = std::numeric_limits<double>::quiet_NaN();
  double force_n = 0;
  double stiffness_n_per_m = 0;  ///< in effect; 0: the fixture does not act
  Breach breach;                 ///< the newest that has ended
};

/// Measures the breaches of one forbidden region.  Thread: one.  RT: safe.
class BreachWatch {
 public:
  /// A contact that stays shallower is no breach: devices and hands move by as much at rest.
  static constexpr double kLeastDepth_m = 1e-4;
  /// A breach ends when the HIP has been outside for this long.
  static constexpr std::int64_t kEnd_ns = 500'000'000;

  /// To be called at each tick. `depth_m`: of the HIP behind the boundary; 0: outside.
  void follow(double depth_m, const Vec3& hip_m_in_world, std::int64_t now_ns) noexcept {
    if (depth_m > kLeastDepth_m) {
      if (!inside_) current_ = {ended_.number + 1, now_ns, hip_m_in_world, 0, 0};
      inside_ = true;
      left_ns_ = now_ns;
      if (depth_m > current_.depth_m) current_.depth_m = depth_m;
    } else if (inside_ && now_ns - left_ns_ > kEnd_ns) {
      inside_ = false;
      current_.duration_s = static_cast<double>(left_ns_ - current_.entered_ns) * 1e-9;
      ended_ = current_;
    }
  }
  const Breach& ended() const noexcept { return ended_; }

 private:
  bool inside_ = false;
  std::int64_t left_ns_ = 0;  ///< when the HIP was inside last
  Breach current_;
  Breach ended_;
};

}  // namespace hapticd::rt
