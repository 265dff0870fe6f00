// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

#include "rt/realtime_safe.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// First-order low-pass filter of a force: y += (1 - exp(-2 pi f T)) (x - y). It delays slow changes by 1 /
/// (2 pi f). Once the output is within kArrived_n of the input it equals the input. The output is never
/// longer than the longest input so far.
/// Thread: one.  Progress: wait-free.  RT: safe.
class LowPass {
 public:
  /// Far below what any device can exert; without it, the output would approach the input but never equal it.
  static constexpr double kArrived_n = 1e-9;

  /// Returns the filtered force. `force_n`: finite; `cutoff_hz`: 0 disables the filter; `period_s`: time
  /// since the previous call, > 0.
  Vec3 apply(const Vec3& force_n, double cutoff_hz, double period_s) HAPTICD_RT {
    if (!(cutoff_hz > 0)) return last_n_ = force_n;
    const double share = -std::expm1(-2 * std::numbers::pi * cutoff_hz * period_s);
    last_n_ = last_n_ + share * (force_n - last_n_);
    if (norm(force_n - last_n_) < kArrived_n) last_n_ = force_n;
    return last_n_;
  }

 private:
  Vec3 last_n_;
};

}  // namespace hapticd::rt
