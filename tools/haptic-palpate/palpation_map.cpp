// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-palpate/palpation_map.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <utility>

namespace hapticd::tools {

bool StiffnessEstimator::counts(const PressSample& sample) {
  return sample.depth_m > kMinDepth_m && std::abs(sample.rate_m_per_s) > kMinRate_m_per_s &&
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
  constexpr double kMinWeight = 5;
  constexpr double kMinIndependence = 1e-6;  // of depth and rate: 1 - correlation^2
  const double determinant = dd_ * vv_ - dv_ * dv_;
  if (weight_ < kMinWeight || !(determinant > kMinIndependence * dd_ * vv_)) return {};
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

namespace {

constexpr double kStep_m = 0.00025;
/// Both layers need samples over at least this depth.
constexpr double kThinnest_m = 0.0015;
constexpr double kMinDifference = 0.1;
constexpr double kMinGain = 0.5;
constexpr std::size_t kMinSamples = 20;

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
  if (count < kMinSamples) return {};
  const auto one = solve(samples, 2 * deepest_m);
  if (!one) return {};
  LayerFit fit{.known = true, .upper_n_per_m = one->values[0], .lower_n_per_m = one->values[0]};
  std::optional<Solution> best;
  double best_m = 0;
  for (double t = StiffnessEstimator::kMinDepth_m + kThinnest_m; t <= deepest_m - kThinnest_m; t += kStep_m) {
    const auto two = solve(samples, t);
    if (two && (!best || two->left_n2 < best->left_n2)) {
      best = two;
      best_m = t;
    }
  }
  if (!best || best->left_n2 > (1 - kMinGain) * one->left_n2) return fit;
  if (std::abs(best->values[1] - best->values[0]) < kMinDifference * std::abs(best->values[0])) return fit;
  fit.layered = true;
  fit.upper_n_per_m = best->values[0];
  fit.lower_n_per_m = best->values[1];
  fit.layer_m = best_m;
  return fit;
}

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
  constexpr std::size_t kMinCells = 4;
  /// The cells wholly above the nodule: their excess is near the largest.
  constexpr double kWhole = 0.8;
  if (cells.size() < kMinCells) return std::nullopt;
  std::vector<double> stiffnesses;
  for (const PalpatedCell& cell : cells) stiffnesses.push_back(cell.layers.lower_n_per_m);
  const double surroundings = medianOf(stiffnesses);
  const double least = Palpation::kMinExcess * surroundings;
  const double largest = *std::ranges::max_element(stiffnesses) - surroundings;
  if (!(largest >= least)) return std::nullopt;

  Nodule nodule{.position_m_in_world = {}, .surroundings_n_per_m = surroundings};
  double sum = 0;
  double whole = 0;
  for (const PalpatedCell& cell : cells) {
    const double excess = cell.layers.lower_n_per_m - surroundings;
    if (excess < Palpation::kMinExcess * largest) continue;
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

namespace {

nlohmann::json jsonOf(const rt::Vec3& v) {
  return {v.x, v.y, v.z};
}

}  // namespace

std::string palpationText(const PalpationMap& map) {
  std::string text = fmt::format("{:>27} {:>8} {:>17} {:>15} {:>8} {:>8} {:>8}\n", "place in mm", "samples",
                                 "K in N/m", "B in N s/m", "upper K", "lower K", "layer mm");
  for (const PalpatedCell& cell : map.cells) {
    const rt::Vec3& p = cell.position_m_in_world;
    const StiffnessEstimate& k = cell.estimate;
    fmt::format_to(std::back_inserter(text),
                   "{:>9.1f}{:>9.1f}{:>9.1f} {:>8} {:>8.1f} +-{:>6.1f} {:>7.3f} +-{:>5.3f} {:>8.1f} {:>8.1f} "
                   "{:>8}\n",
                   1e3 * p.x, 1e3 * p.y, 1e3 * p.z, cell.samples, k.stiffness_n_per_m,
                   k.stiffness_error_n_per_m, k.damping_n_s_per_m, k.damping_error_n_s_per_m,
                   cell.layers.upper_n_per_m, cell.layers.lower_n_per_m,
                   cell.layers.layered ? fmt::format("{:.1f}", 1e3 * cell.layers.layer_m) : "-");
  }
  if (!map.nodule) return text + "No place is stiffer than its surroundings by a quarter.\n";
  const Nodule& nodule = *map.nodule;
  const rt::Vec3& p = nodule.position_m_in_world;
  return text + fmt::format(
                    "Stiffer place: {:.1f} {:.1f} {:.1f} mm, {:.0f} N/m in surroundings of {:.0f} N/m, from "
                    "a depth of {:.1f} mm\n",
                    1e3 * p.x, 1e3 * p.y, 1e3 * p.z, nodule.stiffness_n_per_m, nodule.surroundings_n_per_m,
                    1e3 * nodule.layer_m);
}

std::string palpationJson(const PalpationMap& map) {
  nlohmann::json cells = nlohmann::json::array();
  for (const PalpatedCell& cell : map.cells) {
    cells.push_back({{"position_m_in_world", jsonOf(cell.position_m_in_world)},
                     {"samples", cell.samples},
                     {"stiffness_n_per_m", cell.estimate.stiffness_n_per_m},
                     {"stiffness_error_n_per_m", cell.estimate.stiffness_error_n_per_m},
                     {"damping_n_s_per_m", cell.estimate.damping_n_s_per_m},
                     {"damping_error_n_s_per_m", cell.estimate.damping_error_n_s_per_m},
                     {"layered", cell.layers.layered},
                     {"upper_stiffness_n_per_m", cell.layers.upper_n_per_m},
                     {"lower_stiffness_n_per_m", cell.layers.lower_n_per_m},
                     {"layer_m", cell.layers.layer_m}});
  }
  nlohmann::json nodule;
  if (map.nodule) {
    nodule = {{"position_m_in_world", jsonOf(map.nodule->position_m_in_world)},
              {"stiffness_n_per_m", map.nodule->stiffness_n_per_m},
              {"surroundings_n_per_m", map.nodule->surroundings_n_per_m},
              {"layer_m", map.nodule->layer_m}};
  }
  return nlohmann::json{{"cells", cells}, {"nodule", nodule}}.dump(2) + "\n";
}

}  // namespace hapticd::tools
