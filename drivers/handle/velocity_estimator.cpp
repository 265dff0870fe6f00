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

namespace {

/// Fewer samples make no line.
constexpr std::size_t kLeastSamples = 8;
/// Steps between the lowest and the highest sample relative to the line of a steady motion: rounding alone
/// makes 1, and a line of least squares is not the best one.
constexpr double kSteady_steps = 1.2;
/// Change of the line's share from one sample to the next.
constexpr double kRise = 0.1;
constexpr double kFall = 0.3;

}  // namespace

rt::Vec3 PositionTracker::add(const rt::Vec3& position_m, std::int64_t time_ns) {
  if (!(step_m_ > 0)) return position_m;
  if (!isFinite(position_m)) {
    reset();
    return position_m;
  }
  const std::int64_t gap_ns = time_ns - sample(0).time_ns;
  if (!(gap_ns > 0 && gap_ns <= kMaxGapNs)) count_ = 0;
  newest_ = (newest_ + 1) % kSamples;
  samples_[newest_] = {position_m, time_ns};
  count_ = std::min(count_ + 1, kSamples);
  if (count_ == 1) share_ = {};
  const std::size_t samples = samplesOfLine();
  return {interpolated(&rt::Vec3::x, samples), interpolated(&rt::Vec3::y, samples),
          interpolated(&rt::Vec3::z, samples)};
}

/// Returns the number of samples in the last kLineNs; 0: not as much is known, or they are too many to keep.
std::size_t PositionTracker::samplesOfLine() const {
  std::size_t samples = 0;
  while (samples < count_ && sample(0).time_ns - sample(samples).time_ns <= kLineNs) ++samples;
  return samples < count_ && samples >= kLeastSamples ? samples : 0;
}

double PositionTracker::interpolated(double rt::Vec3::*axis, std::size_t samples) {
  const Sample& now = sample(0);
  const auto timeOf_s = [&](const Sample& s) { return static_cast<double>(s.time_ns - now.time_ns) * 1e-9; };
  const auto positionOf_m = [&](const Sample& s) { return s.position_m.*axis - now.position_m.*axis; };
  bool is_steady = samples > 0;
  double line_m = 0;  // now, from the measured position
  if (is_steady) {
    double sum_t = 0;
    double sum_p = 0;
    double sum_tt = 0;
    double sum_tp = 0;
    for (std::size_t age = 0; age < samples; ++age) {
      const double t = timeOf_s(sample(age));
      const double p = positionOf_m(sample(age));
      sum_t += t;
      sum_p += p;
      sum_tt += t * t;
      sum_tp += t * p;
    }
    const auto n = static_cast<double>(samples);
    const double slope = (n * sum_tp - sum_t * sum_p) / (n * sum_tt - sum_t * sum_t);
    line_m = (sum_p - slope * sum_t) / n;
    double least_m = -line_m;
    double most_m = -line_m;
    for (std::size_t age = 1; age < samples; ++age) {
      const double off_m = positionOf_m(sample(age)) - line_m - slope * timeOf_s(sample(age));
      least_m = std::min(least_m, off_m);
      most_m = std::max(most_m, off_m);
    }
    constexpr double kLongestStep_s = static_cast<double>(kLongestStepNs) * 1e-9;
    is_steady = most_m - least_m <= kSteady_steps * step_m_ && std::abs(slope) * kLongestStep_s >= step_m_;
  }
  double& share = share_.*axis;
  share = std::clamp(share + (is_steady ? kRise : -kFall), 0.0, 1.0);
  return now.position_m.*axis + share * std::clamp(line_m, -0.5 * step_m_, 0.5 * step_m_);
}

}  // namespace hapticd::drivers
