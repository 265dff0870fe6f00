// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/velocity_check.h"

#include <algorithm>
#include <cmath>

namespace hapticd::drivers {

using rt::Vec3;

namespace {

/// A position that leaps farther is a fault of its own (handle_too_fast), and says nothing of the velocity.
constexpr double kLeap_m = 0.01;
constexpr double kFastest_m_per_s = 5;

}  // namespace

bool VelocityCheck::add(const Vec3& position_m, std::int64_t time_ns, const Vec3& claimed_m_per_s,
                        const Vec3& estimated_m_per_s) {
  const std::int64_t gap_ns = time_ns - time_ns_;
  if (!isFinite(claimed_m_per_s) || !isFinite(position_m)) return true;
  if (started_ && gap_ns <= 0) return norm(error_m_) > kTolerance_m + kTolerance_s * speed_m_per_s_;
  const double leap_m = kLeap_m + kFastest_m_per_s * static_cast<double>(gap_ns) * 1e-9;
  if (!started_ || gap_ns > kLongestGapNs || norm(position_m - position_m_) > leap_m) {
    reset();
  } else {
    const double period_s = static_cast<double>(gap_ns) * 1e-9;
    const Vec3 claimed_m = (0.5 * period_s) * (claimed_m_per_s_ + claimed_m_per_s);
    const double kept = std::exp(-period_s / kWindow_s);
    error_m_ = kept * error_m_ + (claimed_m - (position_m - position_m_));
    speed_m_per_s_ = std::max(kept * speed_m_per_s_, norm(estimated_m_per_s));
  }
  started_ = true;
  time_ns_ = time_ns;
  position_m_ = position_m;
  claimed_m_per_s_ = claimed_m_per_s;
  return norm(error_m_) > kTolerance_m + kTolerance_s * speed_m_per_s_;
}

}  // namespace hapticd::drivers
