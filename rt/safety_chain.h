#pragma once

#include "rt/parameters.h"
#include "rt/realtime_safe.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// The way of every force from the law to the device. The order is fixed:
/// scene blend, passivity control, low-pass, slew limit, magnitude clamp, finite check. Of these the last
/// three are built; the first three are the identity.
///
/// Whatever comes in, what goes out is finite, no longer than the magnitude limit and differs from the output
/// before by no more than the slew limit allows. A force over a lowered magnitude limit shrinks at that
/// rate until it is within.
/// Thread: one.  Progress: wait-free.  RT: safe.
class SafetyChain {
 public:
  struct Output {
    Vec3 force_n_in_world;
    bool slew_limited = false;
    bool magnitude_clamped = false;
    bool not_finite = false;  ///< the input was not; zero was aimed at instead
  };

  /// `period_s`: since the call before, > 0.
  Output apply(const Vec3& force_n_in_world, const SafetyParameters& parameters, double period_s) HAPTICD_RT;

  /// What apply() returned last; zero at first.
  const Vec3& lastForce_n_in_world() const noexcept { return last_; }

 private:
  Vec3 last_;
};

}  // namespace hapticd::rt
