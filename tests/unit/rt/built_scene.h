// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>

#include "rt/depth_frame.h"
#include "rt/depth_model.h"
#include "rt/scene.h"
#include "rt/scene_builder.h"

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

}  // namespace hapticd::test
