// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/pareto/organized_neighbor.h"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/organized.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace hapticd::tools {
namespace {

using rt::Vec3;

/// Points in the frame that PCL looks along +z in: x right, y down.
class Organized : public Contender {
 public:
  explicit Organized(const rt::DepthModelParameters& camera)
      : depth_model_(camera, {}),
        cloud_(new pcl::PointCloud<pcl::PointXYZ>(rt::kFrameWidth, rt::kFrameHeight)) {}

  void model(const rt::DepthFrame& frame, const Vec3&) override {
    constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
    cloud_->is_dense = false;
    for (std::uint32_t row = 0; row < rt::kFrameHeight; ++row) {
      for (std::uint32_t column = 0; column < rt::kFrameWidth; ++column) {
        const std::size_t pixel = row * rt::kFrameWidth + column;
        const std::uint16_t raw = frame.raw[pixel];
        const bool is_valid = raw < rt::kRawNoMeasurement && depth_model_.depth_m(raw) > 0;
        cloud_->points[pixel] =
            is_valid ? pointOf(depth_model_.pointInWorld(rt::PackedPixel::pack(column, row, raw)))
                     : pcl::PointXYZ(kNone, kNone, kNone);
      }
    }
    search_.setInputCloud(cloud_);
  }

  Vec3 force_n(const Vec3& hip_m) override {
    const pcl::PointXYZ hip = pointOf(hip_m);
    const int found = search_.nearestKSearch(hip, springs_.max_points, nearest_, distance_squared_);
    const auto radius = static_cast<float>(springs_.radius_m);
    Vec3 sum;
    int chosen = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(found); ++i) {
      if (distance_squared_[i] > radius * radius) continue;
      ++chosen;
      const float distance = std::sqrt(distance_squared_[i]);
      if (distance < 1e-9F) continue;
      const float factor = radius / distance - 1;
      const pcl::PointXYZ& point = cloud_->points[static_cast<std::size_t>(nearest_[i])];
      sum += Vec3{static_cast<double>(factor * (hip.x - point.x)),
                  -static_cast<double>(factor * (hip.y - point.y)),
                  -static_cast<double>(factor * (hip.z - point.z))};
    }
    if (chosen < springs_.min_points) return {};
    return (springs_.stiffness_n_per_m / chosen) * sum;
  }

 private:
  static pcl::PointXYZ pointOf(const Vec3& p_m) {
    return {static_cast<float>(p_m.x), static_cast<float>(-p_m.y), static_cast<float>(-p_m.z)};
  }

  const rt::SpringParameters springs_;
  rt::DepthModel depth_model_;
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud_;
  pcl::search::OrganizedNeighbor<pcl::PointXYZ> search_;
  pcl::Indices nearest_;
  std::vector<float> distance_squared_;
};

}  // namespace

std::unique_ptr<Contender> organizedNeighbor(const rt::DepthModelParameters& camera) {
  return std::make_unique<Organized>(camera);
}

}  // namespace hapticd::tools
