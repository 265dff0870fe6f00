// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "rt/base/vec3.h"
#include "rt/depth/depth_model.h"
#include "rt/modelling/scene_builder.h"
#include "rt/scene/scene.h"

namespace hapticd::test {

/// A flat wall seen by a camera at the world's origin, modelled in a ball around the point in front of it.
class SmallScene {
 public:
  SmallScene();

  /// Part of the wall in a model that ends to both sides.
  rt::Scene scene;
  std::size_t pointCapacity() const { return builder_.pointCapacity(); }

  /// Returns the position on the optical axis at this distance in front of the wall (negative: behind it).
  rt::Vec3 inFrontOfWall(double distance_m) const { return {0, 0, distance_m - wall_depth_m_}; }
  /// Returns a position on the wall, to the side, whose neighbourhood is not modelled.
  rt::Vec3 besideModel() const;

 private:
  rt::DepthModel model_;
  double wall_depth_m_;
  rt::SceneBuilder builder_;
  rt::SceneStorage storage_;
};

}  // namespace hapticd::test
