// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "tests/unit/rt/scene/built_scene.h"
#include "tests/unit/rt/scene/made_up_frame.h"
#include "tests/unit/rt/simd_targets.h"

namespace hapticd::rt {
namespace {

using test::BuiltScene;
using test::FramePointer;

/// One builder and one scene that are reused repeatedly, next to fresh ones.
class ReusedSceneMemory : public test::EachSimdTarget {};

TEST_P(ReusedSceneMemory, HoldsNothingOfTheScenesBefore) {
  const auto model = std::make_unique<DepthModel>(DepthModelParameters{}, PoseParameters{});
  std::vector<FramePointer> frames;
  frames.push_back(test::planeAndSphereFrame(1, {}));
  frames.push_back(test::damagedFrame(2));
  frames.push_back(test::frameOf(drivers::kKinectNoMeasurement));
  frames.push_back(test::randomFrame(3, 271, 1003));
  frames.push_back(test::frameOf(800));
  for (const ModelExtent extent : {ModelExtent::reach, ModelExtent::frame}) {
    GridParameters grid;
    grid.extent = extent;
    grid.point_capacity = 20000;  // occasionally too few
    BuiltScene reused(*model, grid);
    std::mt19937 random(4);
    std::uniform_real_distribution<double> shift(-0.4, 0.4);
    for (int i = 0; i < (extent == ModelExtent::reach ? 30 : 8); ++i) {
      const DepthFrame& frame = *frames[random() % frames.size()];
      const Vec3 centre{shift(random), shift(random), -1.1 + shift(random)};
      BuiltScene fresh(*model, grid);
      test::expectTheSameScene(reused.build(frame, centre), fresh.build(frame, centre));
      if (HasFatalFailure()) return;
    }
  }
}

HAPTICD_FOR_EACH_SIMD_TARGET(ReusedSceneMemory);

}  // namespace
}  // namespace hapticd::rt
