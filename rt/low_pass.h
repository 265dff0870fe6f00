// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

#include "rt/realtime_safe.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// First-order low-pass on a force: y += (1 - exp(-2 pi f T)) (x - y). It delays slow changes by 1 / (2 pi
/// f), and arrives: less than kArrived_n from its input it is its input. Never longer than the longest input
/// so far. Thread: one.  Progress: wait-free.  RT: safe.
class LowPass {
 public:
  /// Far less than any device exerts; without it the output would approach its input and never be equal to
  /// it.
  static constexpr double kArrived_n = 1e-9;

  /// `force_n`: finite; `cutoff_hz`: 0 passes everything on.
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
