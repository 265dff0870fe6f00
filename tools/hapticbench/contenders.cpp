// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>

#include "tools/hapticbench/cost.h"

namespace hapticd::tools {
namespace {

using rt::Vec3;

class Ours : public Contender {
 public:
  Ours(const LawSetting& setting, const rt::DepthModelParameters& camera) : box_(boxFor(setting, camera)) {}

  void model(const rt::DepthFrame& frame, const Vec3& hip_m) override {
    box_->show(frame);
    box_->model(hip_m);
  }
  bool needsModel(const Vec3& hip_m) const override { return box_->wouldModel(hip_m); }
  void release() override { box_->core().release(); }
  Vec3 force_n(const Vec3& hip_m) override { return box_->lawForce(hip_m).force_n_in_world; }

 private:
  std::unique_ptr<OfflineBox> box_;
};

/// A point in single precision, which the libraries use.
struct Point {
  float x, y, z;
};

Point single(const Vec3& p) {
  return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}

/// The paper's law with its parameters on the points of a frame; how the nearest points are found differs.
class OnPoints : public Contender {
 public:
  explicit OnPoints(const rt::DepthModelParameters& camera) : depth_model_(camera, {}) {}

 protected:
  static constexpr double kEverything_m = 1e6;

  /// Returns the points within `within_m` of `centre_m`.
  const std::vector<Vec3>& pointsOf(const rt::DepthFrame& frame, const Vec3& centre_m, double within_m) {
    points_m_.clear();
    const auto width = static_cast<std::uint32_t>(depth_model_.width_px());
    const auto height = static_cast<std::uint32_t>(depth_model_.height_px());
    const auto stride = static_cast<std::uint32_t>(depth_model_.stride_px());
    for (std::uint32_t row = 0; row < height; ++row) {
      for (std::uint32_t column = 0; column < width; ++column) {
        const std::uint16_t raw = frame.raw[row * stride + column];
        if (depth_model_.depth_m(raw) <= 0) continue;
        const Vec3 point = depth_model_.pointInWorld(rt::PackedPixel::pack(column, row, raw), raw);
        const Vec3 away = point - centre_m;
        if (dot(away, away) <= within_m * within_m) points_m_.push_back(point);
      }
    }
    return points_m_;
  }

  /// Adds the spring of another point, eq. (10).
  void addSpring(Vec3& sum, const Point& hip, const Point& point, float distance_squared) const {
    const float distance = std::sqrt(distance_squared);
    if (distance < 1e-9F) return;
    const float factor = static_cast<float>(springs_.radius_m) / distance - 1;
    sum +=
        Vec3{static_cast<double>(factor * (hip.x - point.x)), static_cast<double>(factor * (hip.y - point.y)),
             static_cast<double>(factor * (hip.z - point.z))};
  }
  /// Returns the mean force, eq. (11); zero below N_min points.
  Vec3 mean(const Vec3& sum, std::size_t count) const {
    if (count < static_cast<std::size_t>(springs_.min_points)) return {};
    return (springs_.stiffness_n_per_m / static_cast<double>(count)) * sum;
  }

  const rt::SpringParameters springs_;

 private:
  rt::DepthModel depth_model_;
  std::vector<Vec3> points_m_;
};

/// Visits every point at every evaluation.
class BruteForce : public OnPoints {
 public:
  using OnPoints::OnPoints;

  void model(const rt::DepthFrame& frame, const Vec3& hip_m) override {
    for (auto* coordinates : {&x_, &y_, &z_}) coordinates->clear();
    for (const Vec3& p : pointsOf(frame, hip_m, kEverything_m)) {
      const Point point = single(p);
      x_.push_back(point.x);
      y_.push_back(point.y);
      z_.push_back(point.z);
    }
    distance_squared_.resize(x_.size());
  }

  Vec3 force_n(const Vec3& hip_m) override {
    const Point hip = single(hip_m);
    const auto radius = static_cast<float>(springs_.radius_m);
    // a loop of its own, which the compiler vectorises
    for (std::size_t i = 0; i < x_.size(); ++i) {
      const float dx = x_[i] - hip.x, dy = y_[i] - hip.y, dz = z_[i] - hip.z;
      distance_squared_[i] = dx * dx + dy * dy + dz * dz;
    }
    near_.clear();
    for (std::size_t i = 0; i < x_.size(); ++i) {
      if (distance_squared_[i] <= radius * radius) near_.push_back(i);
    }
    const std::size_t chosen = std::min(near_.size(), static_cast<std::size_t>(springs_.max_points));
    std::ranges::nth_element(near_, near_.begin() + static_cast<std::ptrdiff_t>(chosen), {},
                             [this](std::size_t i) { return distance_squared_[i]; });
    Vec3 sum;
    for (std::size_t i = 0; i < chosen; ++i) {
      const std::size_t point = near_[i];
      addSpring(sum, hip, {x_[point], y_[point], z_[point]}, distance_squared_[point]);
    }
    return mean(sum, chosen);
  }

 private:
  std::vector<float> x_, y_, z_, distance_squared_;
  std::vector<std::size_t> near_;
};

/// nanoflann's k-d tree on what the HIP can reach before the next frame, as we do it, or on all.
class Tree : public OnPoints {
 public:
  Tree(const rt::DepthModelParameters& camera, bool reach_only) : OnPoints(camera), reach_only_(reach_only) {}

  void model(const rt::DepthFrame& frame, const Vec3& hip_m) override {
    const double reach_m =
        rt::reachOfModel_m({.radius_m = springs_.radius_m, .surface = {}, .filter = {}}, {});
    const auto& points_m = pointsOf(frame, hip_m, reach_only_ ? reach_m : kEverything_m);
    index_.reset();
    cloud_.points.clear();
    for (const Vec3& p : points_m) cloud_.points.push_back(single(p));
    index_ = std::make_unique<Index>(3, cloud_, nanoflann::KDTreeSingleIndexAdaptorParams(10));
  }

  Vec3 force_n(const Vec3& hip_m) override {
    const Point hip = single(hip_m);
    const auto most = static_cast<std::size_t>(springs_.max_points);
    nearest_.resize(most);
    distance_squared_.resize(most);
    const std::size_t found = index_->knnSearch(&hip.x, most, nearest_.data(), distance_squared_.data());
    const auto radius = static_cast<float>(springs_.radius_m);
    Vec3 sum;
    std::size_t chosen = 0;
    for (; chosen < found && distance_squared_[chosen] <= radius * radius; ++chosen) {
      addSpring(sum, hip, cloud_.points[nearest_[chosen]], distance_squared_[chosen]);
    }
    return mean(sum, chosen);
  }

 private:
  struct Cloud {
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
  using Index =
      nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Cloud>, Cloud, 3, std::size_t>;

  bool reach_only_;
  Cloud cloud_;
  std::unique_ptr<Index> index_;
  std::vector<std::size_t> nearest_;
  std::vector<float> distance_squared_;
};

}  // namespace

ContenderKind ours(const LawSetting& setting) {
  return {
      nameOf(setting),
      [setting](const rt::DepthModelParameters& camera) { return std::make_unique<Ours>(setting, camera); },
      true, setting, setting.law == rt::ForceLaw::nearest_springs && !setting.filtered};
}

std::vector<ContenderKind> libraries() {
  using Camera = rt::DepthModelParameters;
  std::vector<ContenderKind> kinds;
  const auto add = [&kinds](const char* name, auto make) { kinds.push_back({name, make, false, {}, true}); };
  add("brute force", [](const Camera& camera) { return std::make_unique<BruteForce>(camera); });
  add("nanoflann", [](const Camera& camera) { return std::make_unique<Tree>(camera, false); });
  add("nanoflann, reach only", [](const Camera& camera) { return std::make_unique<Tree>(camera, true); });
  return kinds;
}

}  // namespace hapticd::tools
