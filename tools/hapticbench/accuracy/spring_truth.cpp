// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/accuracy/spring_truth.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hapticd::tools {
namespace {

using rt::Vec3;

/// Points within D of the HIP, as vectors to the HIP.
struct Neighbour {
  double distance_m;
  Vec3 to_hip_m;
};
std::vector<Neighbour> neighboursOf(const std::vector<Vec3>& points_m, const Vec3& hip_m, double radius_m) {
  std::vector<Neighbour> near;
  for (const Vec3& point : points_m) {
    const Vec3 to_hip = hip_m - point;
    const double distance = norm(to_hip);
    if (distance <= radius_m) near.push_back({distance, to_hip});
  }
  return near;
}

/// Eq. (9)-(10) of one point; zero on the point itself.
Vec3 springOf(const Neighbour& neighbour, const rt::SpringParameters& springs) {
  if (neighbour.distance_m < 1e-9) return {};
  const double force_n = springs.stiffness_n_per_m * (springs.radius_m - neighbour.distance_m);
  return (force_n / neighbour.distance_m) * neighbour.to_hip_m;
}

}  // namespace

double nearestDiscRadius_m(const rt::DepthModelParameters& camera, double depth_m, int max_points) {
  const double points_per_m2 = camera.fx_px * camera.fy_px / (depth_m * depth_m);
  return std::sqrt(max_points / (std::numbers::pi * points_per_m2));
}

double nearestSpringsAbovePlane_n(const rt::SpringParameters& springs, double disc_radius_m,
                                  double height_m) {
  const double k = springs.stiffness_n_per_m;
  const double D = springs.radius_m;
  const double h = std::abs(height_m);
  if (h >= D) return 0;
  const double S = std::min(std::hypot(h, disc_radius_m), D);  // the farthest point that counts
  return std::copysign(k * h * (2 * D / (h + S) - 1), height_m);
}

double popThroughForce_n(const rt::SpringParameters& springs, double disc_radius_m) {
  constexpr int kHeights = 4000;
  double largest_n = 0;
  for (int i = 1; i < kHeights; ++i) {
    const double height_m = springs.radius_m * i / kHeights;
    largest_n = std::max(largest_n, nearestSpringsAbovePlane_n(springs, disc_radius_m, height_m));
  }
  return largest_n;
}

double smoothSpringsAbovePlane_n(const rt::SpringParameters& springs, double height_m) {
  const double D = springs.radius_m;
  const double h = std::abs(height_m);
  if (h >= D) return 0;
  return std::copysign(2 * springs.stiffness_n_per_m * h * (D - h) / (D + 2 * h), height_m);
}

std::vector<Vec3> exactPoints_m(const TrueScene& scene, const Vec3& centre, double radius_m, double t_s) {
  const rt::DepthModelParameters& camera = scene.depthModel();
  const double nearest_m = std::max(-centre.z - radius_m, 0.1);
  const double half_width_px = 1 + camera.fx_px * radius_m / nearest_m;
  const double half_height_px = 1 + camera.fy_px * radius_m / nearest_m;
  const double column = camera.cx_px - camera.fx_px * centre.x / centre.z;
  const double row = camera.cy_px + camera.fy_px * centre.y / centre.z;
  const auto clamped = [](double pixel, int count) {
    return static_cast<int>(std::clamp(pixel, 0.0, static_cast<double>(count - 1)));
  };
  std::vector<Vec3> points;
  for (int v = clamped(row - half_height_px, rt::kFrameHeight);
       v <= clamped(row + half_height_px, rt::kFrameHeight); ++v) {
    for (int u = clamped(column - half_width_px, rt::kFrameWidth);
         u <= clamped(column + half_width_px, rt::kFrameWidth); ++u) {
      const double depth = scene.trueDepth(u, v, t_s);
      if (!(depth > 0)) continue;
      const Vec3 point =
          depth * Vec3{(u - camera.cx_px) / camera.fx_px, -(v - camera.cy_px) / camera.fy_px, -1};
      if (norm(point - centre) <= radius_m) points.push_back(point);
    }
  }
  return points;
}

Vec3 nearestSpringsOver_n(const std::vector<Vec3>& points_m, const Vec3& hip_m,
                          const rt::SpringParameters& springs) {
  std::vector<Neighbour> near = neighboursOf(points_m, hip_m, springs.radius_m);
  if (near.size() < static_cast<std::size_t>(springs.min_points)) return {};
  const std::size_t chosen = std::min(near.size(), static_cast<std::size_t>(springs.max_points));
  std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(chosen), near.end(),
                    [](const Neighbour& a, const Neighbour& b) { return a.distance_m < b.distance_m; });
  Vec3 sum;
  for (std::size_t i = 0; i < chosen; ++i) sum += springOf(near[i], springs);
  return (1 / static_cast<double>(chosen)) * sum;
}

Vec3 smoothSpringsOver_n(const std::vector<Vec3>& points_m, const Vec3& hip_m,
                         const rt::SpringParameters& springs) {
  const std::vector<Neighbour> near = neighboursOf(points_m, hip_m, springs.radius_m);
  if (near.size() < static_cast<std::size_t>(springs.min_points)) return {};
  Vec3 sum;
  double weights = 0;
  for (const Neighbour& neighbour : near) {
    const double weight = 1 - neighbour.distance_m / springs.radius_m;
    sum += weight * springOf(neighbour, springs);
    weights += weight;
  }
  return weights > 0 ? (1 / weights) * sum : Vec3{};
}

}  // namespace hapticd::tools
