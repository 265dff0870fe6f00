// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/velocity_estimator.h"

#include <algorithm>
#include <cmath>

namespace hapticd::drivers {

rt::Vec3 VelocityEstimator::add(const rt::Vec3& position_m, std::int64_t time_ns) {
  while (count_ > 0 && time_ns <= newest(0).time_ns) {
    next_ = (next_ + kMaxSamples - 1) % kMaxSamples;
    --count_;
  }
  samples_[next_] = {position_m, time_ns};
  next_ = (next_ + 1) % kMaxSamples;
  count_ = std::min(count_ + 1, kMaxSamples);
  while (count_ > 1 && time_ns - newest(count_ - 1).time_ns > kMaxWindowNs) --count_;
  return {slope(&rt::Vec3::x), slope(&rt::Vec3::y), slope(&rt::Vec3::z)};
}

/// Fits lines over increasingly long windows with running sums relative to the newest sample; returns the
/// slope of the last one that fits.
double VelocityEstimator::slope(double rt::Vec3::*axis) const {
  const Sample& now = newest(0);
  double sum_t = 0;
  double sum_p = 0;
  double sum_tt = 0;
  double sum_tp = 0;
  double best = 0;
  for (std::size_t n = 2; n <= count_; ++n) {
    const Sample& oldest = newest(n - 1);
    if (n > 2 && now.time_ns - oldest.time_ns > kMaxLineNs) return best;
    const double t = static_cast<double>(oldest.time_ns - now.time_ns) * 1e-9;
    const double p = oldest.position_m.*axis - now.position_m.*axis;
    sum_t += t;
    sum_p += p;
    sum_tt += t * t;
    sum_tp += t * p;
    const double samples = static_cast<double>(n);
    const double slope = (samples * sum_tp - sum_t * sum_p) / (samples * sum_tt - sum_t * sum_t);
    const double offset = (sum_p - slope * sum_t) / samples;
    for (std::size_t age = 0; age < n && n > 2; ++age) {
      const Sample& sample = newest(age);
      const double line = offset + slope * static_cast<double>(sample.time_ns - now.time_ns) * 1e-9;
      if (std::abs(sample.position_m.*axis - now.position_m.*axis - line) > resolution_m_) return best;
    }
    best = slope;
  }
  return best;
}

}  // namespace hapticd::drivers
