// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/rt/reference_force.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace hapticd::test {
namespace {

constexpr double kIndistinguishable_m = 1e-12;

struct Neighbour {
  double distance_m;
  std::size_t index;  // in the cloud, therefore in image order
};

std::vector<Neighbour> neighboursWithin(const PointCloud& cloud, const rt::Vec3& hip, double radius_m) {
  std::vector<Neighbour> found;
  const double loose_squared = radius_m * radius_m * 1.0001;
  const double* const x = cloud.x_m.data();
  const double* const y = cloud.y_m.data();
  const double* const z = cloud.z_m.data();
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const double dx = hip.x - x[i];
    const double dy = hip.y - y[i];
    const double dz = hip.z - z[i];
    const double squared = dx * dx + dy * dy + dz * dz;
    if (squared <= loose_squared) found.push_back({std::sqrt(squared), i});
  }
  return found;
}

}  // namespace

ReferenceForce bruteForce(const PointCloud& cloud, const rt::Vec3& hip_m_in_world,
                          const rt::SpringParameters& parameters) {
  ReferenceForce result;
  std::vector<Neighbour> near = neighboursWithin(cloud, hip_m_in_world, parameters.radius_m);
  for (const Neighbour& n : near) {
    if (std::abs(n.distance_m - parameters.radius_m) < kIndistinguishable_m) result.undecided = true;
  }
  std::erase_if(near, [&](const Neighbour& n) { return n.distance_m > parameters.radius_m; });
  if (near.size() < static_cast<std::size_t>(parameters.min_points)) return result;

  std::sort(near.begin(), near.end(), [](const Neighbour& a, const Neighbour& b) {
    return std::pair(a.distance_m, a.index) < std::pair(b.distance_m, b.index);
  });
  const auto max_points = static_cast<std::size_t>(parameters.max_points);
  if (near.size() > max_points) {
    if (near[max_points].distance_m - near[max_points - 1].distance_m < kIndistinguishable_m)
      result.undecided = true;
    near.resize(max_points);
  }
  rt::Vec3 sum;
  for (const Neighbour& n : near) {
    if (n.distance_m < 1e-9) continue;
    const double magnitude = parameters.stiffness_n_per_m * (parameters.radius_m - n.distance_m);
    sum += (magnitude / n.distance_m) * (hip_m_in_world - cloud.position(n.index));
  }
  result.points_used = static_cast<std::uint32_t>(near.size());
  result.force_n_in_world = (1.0 / static_cast<double>(near.size())) * sum;
  return result;
}

double distanceOfRank(const PointCloud& cloud, const rt::Vec3& hip_m_in_world, std::size_t n) {
  std::vector<double> distances(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) distances[i] = norm(hip_m_in_world - cloud.position(i));
  const auto nth = distances.begin() + static_cast<std::ptrdiff_t>(n - 1);
  std::nth_element(distances.begin(), nth, distances.end());
  return *nth;
}

}  // namespace hapticd::test
