// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/pareto/contender.h"

#include "tools/hapticbench/contenders.h"
#include "tools/hapticbench/pareto/organized_neighbor.h"

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

/// What the libraries share: the points of a frame, and the paper's parameters.
class OnPoints : public Contender {
 public:
  explicit OnPoints(const rt::DepthModelParameters& camera) : depth_model_(camera, {}) {}

 protected:
  /// `within_m` of `centre_m`, in squares of the distance.
  const std::vector<Vec3>& pointsOf(const rt::DepthFrame& frame, const Vec3& centre_m, double within_m) {
    points_m_.clear();
    for (std::uint32_t row = 0; row < rt::kFrameHeight; ++row) {
      for (std::uint32_t column = 0; column < rt::kFrameWidth; ++column) {
        const std::uint16_t raw = frame.raw[row * rt::kFrameWidth + column];
        if (raw >= rt::kRawNoMeasurement || depth_model_.depth_m(raw) <= 0) continue;
        const Vec3 point = depth_model_.pointInWorld(rt::PackedPixel::pack(column, row, raw));
        const Vec3 away = point - centre_m;
        if (dot(away, away) <= within_m * within_m) points_m_.push_back(point);
      }
    }
    return points_m_;
  }

  static constexpr double kEverything_m = 1e6;
  const rt::SpringParameters springs_;

 private:
  rt::DepthModel depth_model_;
  std::vector<Vec3> points_m_;
};

class Brute : public OnPoints {
 public:
  using OnPoints::OnPoints;
  void model(const rt::DepthFrame& frame, const Vec3& hip_m) override {
    search_ = std::make_unique<BruteForce>(pointsOf(frame, hip_m, kEverything_m));
  }
  Vec3 force_n(const Vec3& hip_m) override { return search_->force_n(hip_m, springs_); }

 private:
  std::unique_ptr<BruteForce> search_;
};

/// nanoflann on what the HIP can reach before the next frame, as we do it, or on all.
class Tree : public OnPoints {
 public:
  Tree(const rt::DepthModelParameters& camera, bool reach_only) : OnPoints(camera), reach_only_(reach_only) {}
  void model(const rt::DepthFrame& frame, const Vec3& hip_m) override {
    const double reach_m =
        rt::reachOfModel_m({.radius_m = springs_.radius_m, .surface = {}, .filter = {}}, {});
    search_ = std::make_unique<KdTree>(
        KdTree::cloudOf(pointsOf(frame, hip_m, reach_only_ ? reach_m : kEverything_m)));
  }
  Vec3 force_n(const Vec3& hip_m) override { return search_->force_n(hip_m, springs_); }

 private:
  bool reach_only_;
  std::unique_ptr<KdTree> search_;
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
  add("brute force", [](const Camera& camera) { return std::make_unique<Brute>(camera); });
  add("nanoflann", [](const Camera& camera) { return std::make_unique<Tree>(camera, false); });
  add("nanoflann, reach only", [](const Camera& camera) { return std::make_unique<Tree>(camera, true); });
  if (organizedNeighbor(Camera{})) add("PCL OrganizedNeighbor", organizedNeighbor);
  return kinds;
}

}  // namespace hapticd::tools
