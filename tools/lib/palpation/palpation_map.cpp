// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/palpation/palpation_map.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace hapticd::tools {
namespace {

using rt::Vec3;

/// Axes along a surface.
struct Axes {
  Vec3 x, y;
};
Axes axesAcross(const Vec3& normal) {
  const Vec3 other = std::abs(normal.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  const Vec3 y = cross(normal, other);
  const Vec3 unit = (1 / norm(y)) * y;
  return {cross(unit, normal), unit};
}

double medianOf(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace

void Palpation::add(const rt::Tick& tick) {
  if (!rt::isHeld(tick.contact) || tick.outside_model) return;
  const Vec3 to_proxy = tick.proxy_m_in_world - tick.hip_m_in_world;
  const double depth_m = norm(to_proxy);
  if (!(depth_m > 0) || !std::isfinite(depth_m)) return;
  const Vec3 normal = (1 / depth_m) * to_proxy;
  const PressSample sample{depth_m, -dot(tick.handle.velocity_m_per_s_in_world, normal),
                           dot(tick.law_force_n_in_world, normal)};
  if (!StiffnessEstimator::counts(sample)) return;
  presses_.push_back({tick.proxy_m_in_world, sample});
  sum_of_proxies_ += tick.proxy_m_in_world;
  sum_of_normals_ += normal;
}

PalpationMap Palpation::map(double cell_m) const {
  PalpationMap map;
  const double length = norm(sum_of_normals_);
  if (!(length > 0)) return map;
  const Vec3 centre = (1 / static_cast<double>(presses_.size())) * sum_of_proxies_;
  const Axes axes = axesAcross((1 / length) * sum_of_normals_);

  std::map<std::pair<long, long>, std::vector<const Press*>> grid;
  for (const Press& press : presses_) {
    const Vec3 from_centre = press.proxy_m_in_world - centre;
    grid[{std::lround(dot(from_centre, axes.x) / cell_m), std::lround(dot(from_centre, axes.y) / cell_m)}]
        .push_back(&press);
  }
  for (const auto& [place, presses] : grid) {
    PalpatedCell cell;
    cell.samples = presses.size();
    StiffnessEstimator estimator;
    std::vector<PressSample> samples;
    for (const Press* press : presses) {
      cell.position_m_in_world += press->proxy_m_in_world;
      estimator.add(press->sample);
      samples.push_back(press->sample);
    }
    cell.position_m_in_world = (1 / static_cast<double>(presses.size())) * cell.position_m_in_world;
    cell.estimate = estimator.estimate();
    cell.layers = fitLayers(samples);
    if (cell.estimate.known && cell.layers.known) map.cells.push_back(std::move(cell));
  }
  map.nodule = findNodule(map.cells);
  return map;
}

std::optional<Nodule> findNodule(const std::vector<PalpatedCell>& cells) {
  constexpr std::size_t kLeastCells = 4;
  /// The cells wholly above the nodule: their excess is near the largest.
  constexpr double kWhole = 0.8;
  if (cells.size() < kLeastCells) return std::nullopt;
  std::vector<double> stiffnesses;
  for (const PalpatedCell& cell : cells) stiffnesses.push_back(cell.layers.lower_n_per_m);
  const double surroundings = medianOf(stiffnesses);
  const double least = Palpation::kLeastExcess * surroundings;
  const double largest = *std::ranges::max_element(stiffnesses) - surroundings;
  if (!(largest >= least)) return std::nullopt;

  Nodule nodule{.position_m_in_world = {}, .surroundings_n_per_m = surroundings};
  double sum = 0;
  double whole = 0;
  for (const PalpatedCell& cell : cells) {
    const double excess = cell.layers.lower_n_per_m - surroundings;
    if (excess < Palpation::kLeastExcess * largest) continue;
    sum += excess;
    nodule.position_m_in_world += excess * cell.position_m_in_world;
    if (excess < kWhole * largest) continue;
    whole += 1;
    nodule.stiffness_n_per_m += cell.layers.lower_n_per_m;
    nodule.layer_m += cell.layers.layer_m;
  }
  nodule.position_m_in_world = (1 / sum) * nodule.position_m_in_world;
  nodule.stiffness_n_per_m /= whole;
  nodule.layer_m /= whole;
  return nodule;
}

}  // namespace hapticd::tools
