// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>

#include "rt/depth/depth_frame.h"
#include "rt/depth/depth_model.h"
#include "rt/modelling/scene_builder.h"
#include "rt/scene/scene.h"
#include "tools/lib/oracle/reference_camera.h"

namespace hapticd::test {

/// A builder with the memory of one scene, and the scene built last.
class BuiltScene {
 public:
  BuiltScene(const rt::DepthModel& model, const rt::GridParameters& parameters)
      : builder(model, parameters), storage_(builder.shape(), builder.pointCapacity(), builder.model()) {
    storage_.attachTo(scene);
  }

  /// Builds the largest possible ball unless a radius is given. Returns the scene.
  const rt::Scene& build(const rt::DepthFrame& frame, const rt::Vec3& centre_m_in_world = {},
                         double radius_m = std::numeric_limits<double>::infinity()) {
    builder.build(frame, centre_m_in_world, radius_m, scene);
    return scene;
  }

  rt::SceneBuilder builder;
  rt::Scene scene;

 private:
  rt::SceneStorage storage_;
};

inline rt::GridParameters wholeFrameGrid() {
  rt::GridParameters parameters;
  parameters.extent = rt::ModelExtent::frame;
  return parameters;
}

/// Expects that the scene's voxels, ranks and ranges are consistent, and that each voxel's range holds the
/// points whose position is in that voxel (points near its border within the accuracy of the positions).
void expectVoxelsToHoldTheirPoints(const rt::Scene& scene);

/// Expects that the scene contains each point of the frame within its ball exactly once, at the right
/// position, and none that is farther away than the ball's radius plus twice the accuracy of positions.
/// `cloud`: all points of the frame.
void expectAllPointsOfTheBall(const rt::Scene& scene, const tools::PointCloud& cloud);

/// Expects that two scenes are bitwise equal.
void expectTheSameScene(const rt::Scene& actual, const rt::Scene& expected);

}  // namespace hapticd::test
