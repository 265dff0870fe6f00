// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "drivers/camera/kinect_image.h"
#include "rt/base/parameters.h"
#include "rt/base/vec3.h"
#include "rt/depth/depth_frame.h"
#include "rt/depth/depth_model.h"
#include "rt/modelling/scene_builder.h"
#include "rt/scene/scene.h"

namespace hapticd::test {

/// A flat wall seen by a camera at the world's origin, modelled in a ball around the point in front of it.
class SmallScene {
 public:
  SmallScene()
      : model_(rt::DepthModelParameters{}, rt::PoseParameters{}),
        wall_depth_m_(model_.depth_m(kWallRaw)),
        builder_(model_, rt::GridParameters{}),
        storage_(builder_.shape(), builder_.pointCapacity(), builder_.model()) {
    const auto frame = std::make_unique<rt::DepthFrame>();
    std::fill_n(frame->raw, drivers::kKinectPixels, kWallRaw);
    frame->sequence = 1;
    frame->arrival_ns = 0;
    storage_.attachTo(scene);
    // everything that any of the laws reads
    const rt::SceneNeeds all{
        .points = true, .image = true, .hidden = false, .visible_surface = true, .surface = {}, .filter = {}};
    builder_.build(*frame, inFrontOfWall(0), builder_.largestBall_m(), scene, all);
  }

  /// Part of the wall in a model that ends to both sides.
  rt::Scene scene;
  std::size_t pointCapacity() const { return builder_.pointCapacity(); }

  /// Returns the position on the optical axis at this distance in front of the wall (negative: behind it).
  rt::Vec3 inFrontOfWall(double distance_m) const { return {0, 0, distance_m - wall_depth_m_}; }
  /// Returns a position on the wall, to the side, whose neighbourhood is not modelled.
  rt::Vec3 besideModel() const { return inFrontOfWall(0) + rt::Vec3{2 * builder_.largestBall_m(), 0, 0}; }

 private:
  static constexpr std::uint16_t kWallRaw = 700;  ///< about 0.85 m

  rt::DepthModel model_;
  double wall_depth_m_;
  rt::SceneBuilder builder_;
  rt::SceneStorage storage_;
};

}  // namespace hapticd::test
