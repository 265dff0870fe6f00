// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "rt/depth_model.h"
#include "rt/scene.h"
#include "rt/scene_builder.h"
#include "rt/vec3.h"

namespace hapticd::test {

/// A flat wall that a camera in the world's origin looks at, modelled in a ball around the point before it.
class SmallScene {
 public:
  SmallScene();

  /// Cut out of a model; both ways across the wall are sideways.
  rt::Scene scene;
  std::size_t pointCapacity() const { return builder_.pointCapacity(); }

  /// On the optical axis, that far in front of the wall (negative: behind it).
  rt::Vec3 inFrontOfWall(double distance_m) const { return {0, 0, distance_m - wall_depth_m_}; }
  /// A position whose neighbourhood is not modelled: to the side, on the wall.
  rt::Vec3 besideModel() const;

 private:
  rt::DepthModel model_;
  double wall_depth_m_;
  rt::SceneBuilder builder_;
  rt::SceneStorage storage_;
};

}  // namespace hapticd::test
