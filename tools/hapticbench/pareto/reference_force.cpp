// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/pareto/reference_force.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace hapticd::tools {

ReferenceForce::ReferenceForce(const rt::DepthFrame& frame, const rt::DepthModelParameters& parameters) {
  for (int v = 0; v < rt::kFrameHeight; ++v) {
    for (int u = 0; u < rt::kFrameWidth; ++u) {
      const int raw = frame.raw[v * rt::kFrameWidth + u];
      const double w = parameters.a_per_m * raw + parameters.b_per_m;
      if (raw >= rt::kRawNoMeasurement || w <= 0 || 1 / w < parameters.near_m || 1 / w > parameters.far_m) {
        continue;
      }
      points_m_.push_back({(u - parameters.cx_px) / parameters.fx_px / w,
                           -(v - parameters.cy_px) / parameters.fy_px / w, -1 / w});
    }
  }
}

ReferenceForce::Sample ReferenceForce::at(const rt::Vec3& hip_m, const rt::SpringParameters& springs) const {
  std::vector<std::pair<double, std::size_t>> near;  // distance, point
  for (std::size_t i = 0; i < points_m_.size(); ++i) {
    const double distance = norm(hip_m - points_m_[i]);
    if (distance <= springs.radius_m) near.emplace_back(distance, i);
  }
  if (near.size() < static_cast<std::size_t>(springs.min_points)) return {};
  std::sort(near.begin(), near.end());
  const std::size_t chosen = std::min(near.size(), static_cast<std::size_t>(springs.max_points));
  Sample sample;
  if (near.size() > chosen) sample.gap_m = near[chosen].first - near[chosen - 1].first;
  for (std::size_t i = 0; i < chosen; ++i) {
    const auto [distance, point] = near[i];
    if (distance < 1e-9) continue;
    const rt::Vec3 direction = (1 / distance) * (hip_m - points_m_[point]);
    sample.force_n += (springs.stiffness_n_per_m * (springs.radius_m - distance)) * direction;
  }
  sample.force_n = (1.0 / static_cast<double>(chosen)) * sample.force_n;
  return sample;
}

}  // namespace hapticd::tools
