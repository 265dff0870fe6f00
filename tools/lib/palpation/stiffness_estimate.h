// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hapticd::tools {

/// One moment of a contact.
struct PressSample {
  double depth_m = 0;
  double rate_m_per_s = 0;  ///< of the depth
  double force_n = 0;       ///< along the normal
};

/// Stiffness and damping with their standard errors, from the variance of what the fit leaves.
struct StiffnessEstimate {
  double stiffness_n_per_m = 0;
  double damping_n_s_per_m = 0;
  double stiffness_error_n_per_m = 0;
  double damping_error_n_s_per_m = 0;
  bool known = false;  ///< there were enough samples, at different depths and rates
};

/// Recursive least squares of K and B in F = K d + B d', with exponential forgetting, in the form of sums:
/// without a first guess, and exact for any order of magnitude of the samples.
class StiffnessEstimator {
 public:
  static constexpr double kForgetting = 0.995;
  /// Shallower and slower samples say more about noise than about the tissue.
  static constexpr double kLeastDepth_m = 0.001;
  static constexpr double kLeastRate_m_per_s = 0.002;

  explicit StiffnessEstimator(double forgetting = kForgetting) : forgetting_(forgetting) {}

  /// Returns true if a sample is deep and fast enough to count.
  static bool counts(const PressSample& sample);
  /// Adds a sample if it counts; not finite: ignored.
  void add(const PressSample& sample);
  StiffnessEstimate estimate() const;

 private:
  double forgetting_;
  double weight_ = 0;  ///< sum of the samples' weights
  double dd_ = 0, dv_ = 0, vv_ = 0, fd_ = 0, fv_ = 0, ff_ = 0;
};

}  // namespace hapticd::tools
