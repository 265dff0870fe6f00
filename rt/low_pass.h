#pragma once

#include <cmath>
#include <numbers>

#include "rt/realtime_safe.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// First-order low-pass on a force: y += (1 - exp(-2 pi f T)) (x - y). It delays slow changes by 1 / (2 pi
/// f). Never longer than the longest input so far. Thread: one.  Progress: wait-free.  RT: safe.
class LowPass {
 public:
  /// `force_n`: finite; `cutoff_hz`: 0 passes everything on.
  Vec3 apply(const Vec3& force_n, double cutoff_hz, double period_s) HAPTICD_RT {
    if (!(cutoff_hz > 0)) return last_n_ = force_n;
    const double share = -std::expm1(-2 * std::numbers::pi * cutoff_hz * period_s);
    return last_n_ = last_n_ + share * (force_n - last_n_);
  }

 private:
  Vec3 last_n_;
};

}  // namespace hapticd::rt
