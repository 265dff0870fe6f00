// SPDX-License-Identifier: Apache-2.0
#include "tests/rt/small_scene.h"

#include <algorithm>
#include <memory>

#include "drivers/camera/kinect_image.h"
#include "rt/base/parameters.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::test {
namespace {

constexpr std::uint16_t kWallRaw = 700;  // about 0.85 m

}  // namespace

SmallScene::SmallScene()
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

rt::Vec3 SmallScene::besideModel() const {
  return inFrontOfWall(0) + rt::Vec3{2 * builder_.largestBall_m(), 0, 0};
}

}  // namespace hapticd::test
