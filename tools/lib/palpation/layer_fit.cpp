// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/palpation/layer_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>

namespace hapticd::tools {
namespace {

constexpr double kStep_m = 0.00025;
/// Both layers need samples over at least this depth.
constexpr double kThinnest_m = 0.0015;
constexpr double kLeastDifference = 0.1;
constexpr double kLeastGain = 0.5;
constexpr std::size_t kLeastSamples = 20;

struct Solution {
  Eigen::Vector3d values;  // K1, K2, B
  double left_n2;
};

/// Fits two layers with the boundary at `layer_m`; one layer if that is infinite.
std::optional<Solution> solve(const std::vector<PressSample>& samples, double layer_m) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  const auto row = [layer_m](const PressSample& sample) {
    return Eigen::Vector3d(std::min(sample.depth_m, layer_m), std::max(sample.depth_m - layer_m, 0.0),
                           sample.rate_m_per_s);
  };
  for (const PressSample& sample : samples) {
    if (!StiffnessEstimator::counts(sample)) continue;
    const Eigen::Vector3d r = row(sample);
    normal += r * r.transpose();
    right += sample.force_n * r;
  }
  if (normal(1, 1) == 0) normal(1, 1) = 1;  // one layer: K2 is not used
  const Eigen::FullPivLU<Eigen::Matrix3d> factors(normal);
  if (!factors.isInvertible()) return std::nullopt;
  Solution solution{factors.solve(right), 0};
  for (const PressSample& sample : samples) {
    if (!StiffnessEstimator::counts(sample)) continue;
    const double left_n = sample.force_n - row(sample).dot(solution.values);
    solution.left_n2 += left_n * left_n;
  }
  return solution;
}

}  // namespace

LayerFit fitLayers(const std::vector<PressSample>& samples) {
  std::size_t count = 0;
  double deepest_m = 0;
  for (const PressSample& sample : samples) {
    if (!StiffnessEstimator::counts(sample)) continue;
    ++count;
    deepest_m = std::max(deepest_m, sample.depth_m);
  }
  if (count < kLeastSamples) return {};
  const auto one = solve(samples, 2 * deepest_m);
  if (!one) return {};
  LayerFit fit{.known = true, .upper_n_per_m = one->values[0], .lower_n_per_m = one->values[0]};
  std::optional<Solution> best;
  double best_m = 0;
  for (double t = StiffnessEstimator::kLeastDepth_m + kThinnest_m; t <= deepest_m - kThinnest_m;
       t += kStep_m) {
    const auto two = solve(samples, t);
    if (two && (!best || two->left_n2 < best->left_n2)) {
      best = two;
      best_m = t;
    }
  }
  if (!best || best->left_n2 > (1 - kLeastGain) * one->left_n2) return fit;
  if (std::abs(best->values[1] - best->values[0]) < kLeastDifference * std::abs(best->values[0])) return fit;
  fit.layered = true;
  fit.upper_n_per_m = best->values[0];
  fit.lower_n_per_m = best->values[1];
  fit.layer_m = best_m;
  return fit;
}

}  // namespace hapticd::tools
