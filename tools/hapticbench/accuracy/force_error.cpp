// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/accuracy/force_error.h"

#include <numbers>

namespace hapticd::tools {
namespace {

constexpr double kNoDirection_n = 0.05;  // half the smallest force that a person notices

double angle_deg(const rt::Vec3& a, const rt::Vec3& b) {
  // by the chord between the unit vectors, which is exact for small angles where the cosine is not
  const double chord = norm((1 / norm(a)) * a - (1 / norm(b)) * b);
  return 2 * std::asin(std::min(chord / 2, 1.0)) * 180 / std::numbers::pi;
}

}  // namespace

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
    direction_deg.add(angle_deg(force_n, truth_n));
}

void ForceErrors::add(const ForceErrors& other) {
  error_n.add(other.error_n);
  error_percent.add(other.error_percent);
  error_jnd.add(other.error_jnd);
  direction_deg.add(other.direction_deg);
}

}  // namespace hapticd::tools
