// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/oracle/spring_oracle.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace hapticd::tools {
namespace {

constexpr double kCoincident_m = 1e-9;
/// Limit of alternatives; a scene with more is too symmetric to be compared.
constexpr int kMaxChoices = 20000;

}  // namespace

SpringOracle::Neighbour SpringOracle::neighbourAt(const rt::Vec3& point_m, const rt::Vec3& hip_m,
                                                  double distance_m, const rt::SpringParameters& springs) {
  if (distance_m < kCoincident_m) return {distance_m, {}};
  const double magnitude_n = springs.stiffness_n_per_m * (springs.radius_m - distance_m);
  return {distance_m, (magnitude_n / distance_m) * (hip_m - point_m)};
}

rt::Vec3 SpringOracle::sumOf(std::span<const Neighbour> neighbours) {
  rt::Vec3 sum;
  for (const Neighbour& neighbour : neighbours) sum += neighbour.spring_n;
  return sum;
}

SpringOracle::SpringOracle(std::span<const rt::Vec3> points_m, const rt::Vec3& hip_m,
                           const rt::SpringParameters& springs) {
  // a little more than the ball, so that few distances are computed; the exact distance decides
  const double loose_squared = springs.radius_m * springs.radius_m * 1.0001;
  for (const rt::Vec3& point_m : points_m) {
    const rt::Vec3 to_hip = hip_m - point_m;
    const double squared = dot(to_hip, to_hip);
    if (squared > loose_squared) continue;
    const double distance_m = std::sqrt(squared);
    radius_margin_m_ = std::min(radius_margin_m_, std::abs(distance_m - springs.radius_m));
    if (distance_m <= springs.radius_m) near_.push_back(neighbourAt(point_m, hip_m, distance_m, springs));
  }
  if (near_.size() < static_cast<std::size_t>(springs.min_points)) return;
  std::ranges::stable_sort(near_, {}, &Neighbour::distance_m);
  const std::size_t count = std::min(near_.size(), static_cast<std::size_t>(springs.max_points));
  if (near_.size() > count) rank_margin_m_ = near_[count].distance_m - near_[count - 1].distance_m;
  points_used_ = static_cast<std::uint32_t>(count);
  force_n_ = (1.0 / static_cast<double>(count)) * sumOf(std::span(near_).first(count));
}

double SpringOracle::error_n(const rt::Vec3& force_n, double tie_m) const {
  double smallest_n = norm(force_n - force_n_);
  const std::size_t count = points_used_;
  if (count == 0 || count == near_.size()) return smallest_n;

  const double last_m = near_[count - 1].distance_m;
  const auto begin = std::ranges::upper_bound(near_, last_m - tie_m, {}, &Neighbour::distance_m);
  const auto end = std::ranges::lower_bound(near_, last_m + tie_m, {}, &Neighbour::distance_m);
  const auto certain = static_cast<std::size_t>(begin - near_.begin());
  const rt::Vec3 certain_sum = sumOf(std::span(near_).first(certain));
  const std::span<const Neighbour> tied(begin, end);
  std::vector<bool> taken(tied.size(), false);
  std::fill_n(taken.begin(), count - certain, true);
  int choices = 0;
  do {
    if (++choices > kMaxChoices) throw std::runtime_error("too many points are equally far");
    rt::Vec3 sum = certain_sum;
    for (std::size_t i = 0; i < tied.size(); ++i) {
      if (taken[i]) sum += tied[i].spring_n;
    }
    smallest_n = std::min(smallest_n, norm(force_n - (1.0 / static_cast<double>(count)) * sum));
  } while (std::prev_permutation(taken.begin(), taken.end()));
  return smallest_n;
}

}  // namespace hapticd::tools
