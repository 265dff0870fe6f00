// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/palpation/stiffness_estimate.h"

#include <algorithm>
#include <cmath>

namespace hapticd::tools {

bool StiffnessEstimator::counts(const PressSample& sample) {
  return sample.depth_m > kLeastDepth_m && std::abs(sample.rate_m_per_s) > kLeastRate_m_per_s &&
         std::isfinite(sample.depth_m + sample.rate_m_per_s + sample.force_n);
}

void StiffnessEstimator::add(const PressSample& sample) {
  if (!counts(sample)) return;
  const double d = sample.depth_m;
  const double v = sample.rate_m_per_s;
  const double f = sample.force_n;
  weight_ = forgetting_ * weight_ + 1;
  dd_ = forgetting_ * dd_ + d * d;
  dv_ = forgetting_ * dv_ + d * v;
  vv_ = forgetting_ * vv_ + v * v;
  fd_ = forgetting_ * fd_ + f * d;
  fv_ = forgetting_ * fv_ + f * v;
  ff_ = forgetting_ * ff_ + f * f;
}

StiffnessEstimate StiffnessEstimator::estimate() const {
  constexpr double kLeastWeight = 5;
  constexpr double kLeastIndependence = 1e-6;  // of depth and rate: 1 - correlation^2
  const double determinant = dd_ * vv_ - dv_ * dv_;
  if (weight_ < kLeastWeight || !(determinant > kLeastIndependence * dd_ * vv_)) return {};
  StiffnessEstimate estimate;
  estimate.known = true;
  estimate.stiffness_n_per_m = (fd_ * vv_ - fv_ * dv_) / determinant;
  estimate.damping_n_s_per_m = (fv_ * dd_ - fd_ * dv_) / determinant;
  const double left_n2 =
      std::max(0.0, ff_ - estimate.stiffness_n_per_m * fd_ - estimate.damping_n_s_per_m * fv_);
  const double variance_n2 = left_n2 / (weight_ - 2);
  estimate.stiffness_error_n_per_m = std::sqrt(variance_n2 * vv_ / determinant);
  estimate.damping_error_n_s_per_m = std::sqrt(variance_n2 * dd_ / determinant);
  return estimate;
}

}  // namespace hapticd::tools
