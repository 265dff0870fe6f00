// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/engine/measures.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace hapticd::tools {

double Exceedance::percent() const {
  return percentOf(above, ticks);
}

void Exceedance::add(const Exceedance& other) {
  ticks += other.ticks;
  above += other.above;
  longest = std::max(longest, other.longest);
  largest = std::max(largest, other.largest);
}

Exceedance exceedance(std::span<const double> values, double limit) {
  Exceedance result{.ticks = values.size()};
  std::size_t run = 0;
  for (const double value : values) {
    run = value > limit ? run + 1 : 0;
    result.above += run > 0 ? 1 : 0;
    result.longest = std::max(result.longest, run);
    result.largest = std::max(result.largest, value);
  }
  return result;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto last = static_cast<double>(values.size() - 1);
  const auto place = values.begin() + std::lround(share * last);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

double robustDeviation(std::vector<double> residuals) {
  constexpr double kNormalDeviation = 1.4826;  // of a normal distribution whose median magnitude is one
  for (double& residual : residuals) residual = std::abs(residual);
  return kNormalDeviation * quantile(std::move(residuals), 0.5);
}

double rootMeanSquare(std::span<const double> values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return values.empty() ? 0 : std::sqrt(sum / static_cast<double>(values.size()));
}

namespace {

constexpr double kNoDirection_n = 0.05;  // half the smallest force that a person notices

}  // namespace

double angleBetween_deg(const rt::Vec3& a, const rt::Vec3& b) {
  // by the chord between the unit vectors, which is exact for small angles where the cosine is not
  const double chord = norm((1 / norm(a)) * a - (1 / norm(b)) * b);
  return 2 * std::asin(std::min(chord / 2, 1.0)) * 180 / std::numbers::pi;
}

bool isRightForce(const rt::Vec3& force_n, const rt::Vec3& true_n) {
  constexpr double kSize_n = 0.5;
  const double size_n = norm(force_n);
  const double true_size_n = norm(true_n);
  if (std::abs(size_n - true_size_n) > std::max(kSize_n, justNoticeableDifference_n(true_size_n)))
    return false;
  if (size_n < 2 * kNoDirection_n || true_size_n == 0) return true;
  return angleBetween_deg(force_n, true_n) <= kRightDirection_deg;
}

double justNoticeableDifference_n(double force_n) {
  return std::max(0.07 * force_n, 0.1);
}

void ForceErrors::add(const rt::Vec3& force_n, const rt::Vec3& truth_n) {
  const double truth = norm(truth_n);
  const double error = norm(force_n - truth_n);
  error_n.add(error);
  error_jnd.add(error / justNoticeableDifference_n(truth));
  if (truth > 0) error_percent.add(100 * error / truth);
  if (truth > kNoDirection_n && norm(force_n) > kNoDirection_n)
    direction_deg.add(angleBetween_deg(force_n, truth_n));
}

void ForceErrors::add(const ForceErrors& other) {
  error_n.add(other.error_n);
  error_percent.add(other.error_percent);
  error_jnd.add(other.error_jnd);
  direction_deg.add(other.direction_deg);
}

namespace {

constexpr double kContact_n = 0.25;
constexpr double kIdealContact_n = 0.5;

}  // namespace

PopThrough judgePush(std::span<const double> outward_n, std::span<const double> ideal_n) {
  PopThrough push;
  for (std::size_t tick = 0; tick < outward_n.size(); ++tick) {
    const double force_n = outward_n[tick];
    if (force_n > push.largest_n) {
      push.dipped = push.dipped || push.popped;
      push.popped = false;
      push.largest_n = force_n;
      push.largest_tick = tick;
      continue;
    }
    const bool gives_way = push.largest_n >= kContact_n && force_n < push.largest_n / 2;
    const bool holds_nothing = ideal_n[tick] >= kIdealContact_n && force_n <= 0;
    push.popped = push.popped || gives_way || holds_nothing;
  }
  return push;
}

double popThroughForceOnPlane_n(const rt::SpringParameters& springs, const rt::DepthModelParameters& camera,
                                double depth_m) {
  constexpr int kHeights = 4000;
  const double points_per_m2 = camera.fx_px * camera.fy_px / (depth_m * depth_m);
  const double disc_radius_m = std::sqrt(springs.max_points / (std::numbers::pi * points_per_m2));
  double largest_n = 0;
  for (int i = 1; i < kHeights; ++i) {
    const double height_m = springs.radius_m * i / kHeights;
    const double farthest_m = std::min(std::hypot(height_m, disc_radius_m), springs.radius_m);
    largest_n = std::max(largest_n, springs.stiffness_n_per_m * height_m *
                                        (2 * springs.radius_m / (height_m + farthest_m) - 1));
  }
  return largest_n;
}

}  // namespace hapticd::tools
