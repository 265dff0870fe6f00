// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include "rt/depth/depth_frame.h"
#include "rt/depth/depth_model.h"
#include "rt/tracking/solid_tracker.h"
#include "tools/lib/truth/any_camera.h"
#include "tools/lib/truth/known_solid.h"

namespace hapticd::test {

/// Solids before a noisy Kinect, and a tracker of one of them.
class TrackedScene {
 public:
  TrackedScene(tools::SolidKind kind, std::uint32_t seed)
      : kind_(kind),
        solid_(kind, 0.0015),
        camera_(model.parameters()),
        sensor_(seed),
        random_(seed),
        frame_(std::make_unique<rt::DepthFrame>()),
        tracker(solid_.grid()) {
    frame_->camera = model.parameters();
  }

  /// Puts the solid there, turned by up to a quarter radian, and its target where its surface faces the
  /// camera.
  void place(double distance_m) {
    truth = rt::movedInSolid({.position_m = {0.03 * uniform(), 0.03 * uniform(), -distance_m}}, {},
                             0.25 * direction(), {});
    const rt::Vec3 towards = (-1 / norm(truth.position_m)) * truth.directionIn(truth.position_m);
    double along_m = 0.1;
    for (int step = 0; step < 200; ++step) along_m -= distanceFrom(kind_, along_m * towards);
    request = {};
    request.predicted = truth;
    request.last = truth;
    request.target_m_in_solid = along_m * towards;
  }
  /// Takes a frame of the solid, before a wall 0.1 m behind it, and of what else is there.
  void show(const std::vector<tools::PlacedSolid>& others = {}) {
    std::vector<tools::PlacedSolid> all = others;
    all.push_back({kind_, truth});
    showOnly(all);
  }
  void showOnly(const std::vector<tools::PlacedSolid>& solids) {
    tools::measure(solids, 0.1 - truth.position_m.z, camera_);
    sensor_.deliver(camera_, ++frames_, tools::SceneNoise::harsh, *frame_);
    camera_.removeOutsideLimits(*frame_);
  }
  /// The prediction is off by this, in random directions.
  void predict(double shift_m, double rotation_rad) {
    request.predicted = rt::movedInSolid(truth, {}, rotation_rad * direction(), shift_m * direction());
  }
  rt::Tracking track() { return tracker.step(model, frame_->image(), request, limits); }
  rt::DepthFrame& frame() { return *frame_; }

  double error_m(const rt::Tracking& tracking) const {
    return norm(tracking.pose.placeOut(request.target_m_in_solid) -
                truth.placeOut(request.target_m_in_solid));
  }
  rt::Vec3 direction() {
    std::normal_distribution<double> normal;
    const rt::Vec3 v{normal(random_), normal(random_), normal(random_)};
    return (1 / norm(v)) * v;
  }
  double uniform() { return std::uniform_real_distribution(-1.0, 1.0)(random_); }

  const rt::DepthModel model{tools::kinectWithNoise(), {}};
  rt::SolidPose truth{};
  rt::TrackingRequest request{};
  rt::TrackingLimits limits{};

 private:
  tools::SolidKind kind_;
  tools::SolidGrid solid_;
  drivers::SceneCamera camera_;
  tools::SceneSensor sensor_;
  std::mt19937 random_;
  std::unique_ptr<rt::DepthFrame> frame_;
  std::uint64_t frames_ = 0;

 public:
  rt::SolidTracker tracker;
};

}  // namespace hapticd::test
