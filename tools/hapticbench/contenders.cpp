// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/contenders.h"

#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>

namespace hapticd::tools {
namespace {

struct Point {
  float x, y, z;
};

/// Sum of eq. (10) over one point more.
void addSpring(rt::Vec3& sum, const Point& hip, const Point& point, float distance_squared,
               const rt::SpringParameters& springs) {
  const float distance = std::sqrt(distance_squared);
  if (distance < 1e-9F) return;
  const float factor = static_cast<float>(springs.radius_m) / distance - 1;
  sum += rt::Vec3{static_cast<double>(factor * (hip.x - point.x)),
                  static_cast<double>(factor * (hip.y - point.y)),
                  static_cast<double>(factor * (hip.z - point.z))};
}

Point single(const rt::Vec3& p) {
  return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}

rt::Vec3 mean(const rt::Vec3& sum, std::size_t count, const rt::SpringParameters& springs) {
  return (springs.stiffness_n_per_m / static_cast<double>(count)) * sum;
}

}  // namespace

BruteForce::BruteForce(const std::vector<rt::Vec3>& points_m) : distance_squared_(points_m.size()) {
  for (const rt::Vec3& p : points_m) {
    const Point point = single(p);
    x_.push_back(point.x);
    y_.push_back(point.y);
    z_.push_back(point.z);
  }
  near_.reserve(points_m.size());
}

rt::Vec3 BruteForce::force_n(const rt::Vec3& hip_m, const rt::SpringParameters& springs) {
  const Point hip = single(hip_m);
  const auto radius = static_cast<float>(springs.radius_m);
  for (std::size_t i = 0; i < x_.size(); ++i) {
    const float dx = x_[i] - hip.x;
    const float dy = y_[i] - hip.y;
    const float dz = z_[i] - hip.z;
    distance_squared_[i] = dx * dx + dy * dy + dz * dz;
  }
  near_.clear();
  for (std::size_t i = 0; i < x_.size(); ++i) {
    if (distance_squared_[i] <= radius * radius) near_.push_back(i);
  }
  if (near_.size() < static_cast<std::size_t>(springs.min_points)) return {};
  const std::size_t chosen = std::min(near_.size(), static_cast<std::size_t>(springs.max_points));
  if (chosen < near_.size()) {
    std::nth_element(
        near_.begin(), near_.begin() + static_cast<std::ptrdiff_t>(chosen), near_.end(),
        [this](std::size_t a, std::size_t b) { return distance_squared_[a] < distance_squared_[b]; });
  }
  rt::Vec3 sum;
  for (std::size_t i = 0; i < chosen; ++i) {
    const std::size_t point = near_[i];
    addSpring(sum, hip, {x_[point], y_[point], z_[point]}, distance_squared_[point], springs);
  }
  return mean(sum, chosen, springs);
}

struct KdTree::Cloud {
  std::vector<Point> points;

  // the names that nanoflann calls
  std::size_t kdtree_get_point_count() const { return points.size(); }
  float kdtree_get_pt(std::size_t index, std::size_t axis) const {
    const Point& p = points[index];
    return axis == 0 ? p.x : axis == 1 ? p.y : p.z;
  }
  template <typename Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

struct KdTree::Index {
  using Tree =
      nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Cloud>, Cloud, 3, std::size_t>;
  explicit Index(const Cloud& cloud) : tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(10)) {}
  Tree tree;
};

std::shared_ptr<const KdTree::Cloud> KdTree::cloudOf(const std::vector<rt::Vec3>& points_m) {
  auto cloud = std::make_shared<Cloud>();
  cloud->points.reserve(points_m.size());
  for (const rt::Vec3& p : points_m) cloud->points.push_back(single(p));
  return cloud;
}

KdTree::KdTree(std::shared_ptr<const Cloud> cloud)
    : cloud_(std::move(cloud)), index_(std::make_unique<Index>(*cloud_)) {}

KdTree::~KdTree() = default;

rt::Vec3 KdTree::force_n(const rt::Vec3& hip_m, const rt::SpringParameters& springs) {
  const Point hip = single(hip_m);
  const auto wanted = static_cast<std::size_t>(springs.max_points);
  nearest_.resize(wanted);
  distance_squared_.resize(wanted);
  const std::size_t found = index_->tree.knnSearch(&hip.x, wanted, nearest_.data(), distance_squared_.data());
  const auto radius = static_cast<float>(springs.radius_m);
  rt::Vec3 sum;
  std::size_t chosen = 0;
  for (; chosen < found && distance_squared_[chosen] <= radius * radius; ++chosen) {
    addSpring(sum, hip, cloud_->points[nearest_[chosen]], distance_squared_[chosen], springs);
  }
  if (chosen < static_cast<std::size_t>(springs.min_points)) return {};
  return mean(sum, chosen, springs);
}

}  // namespace hapticd::tools
