// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/falcon/falcon_forces.h"

#include <algorithm>
#include <cmath>

namespace hapticd::drivers {
namespace {

// Scale of libnifalcon. Traces of the vendor's driver quoted there show 0.23 to 0.4 of it, hence
// `force_share`, which must be calibrated with a scale.
constexpr double kCountsPerNewtonMetre = -10000;

}  // namespace

FalconForce motorCountsFor(const FalconPose& pose, const rt::Vec3& force_n, double force_share) {
  FalconForce force;
  const std::array<double, 3> torques = thighTorquesOf(pose, force_n);
  std::array<double, 3> counts{};
  double largest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    counts[k] = kCountsPerNewtonMetre * force_share * torques[k];
    if (!std::isfinite(counts[k])) return {};
    largest = std::max(largest, std::abs(counts[k]));
  }
  if (largest > kMaxMotorCounts) force.exerted_share = kMaxMotorCounts / largest;
  for (std::size_t k = 0; k < 3; ++k) {
    force.motor_counts[k] = static_cast<int>(std::lround(force.exerted_share * counts[k]));
  }
  return force;
}

}  // namespace hapticd::drivers
