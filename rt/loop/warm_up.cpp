// SPDX-License-Identifier: Apache-2.0
#include "rt/loop/warm_up.h"

#include <algorithm>
#include <memory>

#include "rt/depth/depth_frame.h"
#include "rt/laws/law_table.h"
#include "rt/loop/haptic_core.h"
#include "rt/modelling/scene_builder.h"

namespace hapticd::rt {

void warmUp(HapticCore& core, std::size_t point_capacity) {
  constexpr std::uint16_t kRaw = 750;  // a wall about 1 m away
  const auto model = std::make_unique<DepthModel>(DepthModelParameters{}, PoseParameters{});
  const auto frame = std::make_unique<DepthFrame>();
  std::fill_n(frame->raw, model->pixels(), kRaw);
  frame->sequence = 1;

  GridParameters grid;
  grid.point_capacity = static_cast<int>(std::min<std::size_t>(point_capacity, model->pixels()));
  SceneBuilder builder(*model, grid);
  const SceneStorage storage(builder.shape(), builder.pointCapacity(), *model);
  Scene scene;
  storage.attachTo(scene);
  const Vec3 wall{0, 0, -model->depth_m(kRaw)};
  for (const ForceLawRow& row : kForceLaws) {
    LiveParameters parameters;
    parameters.law = row.law;
    builder.build(*frame, wall, builder.largestBall_m(), scene, SceneNeeds::of(parameters));
    core.release();
    for (int step = 100; step >= -10; --step) {
      constexpr double kStep_m = 0.001;
      core.lawForce(scene, wall + Vec3{0, 0, step * kStep_m}, parameters);
    }
  }
  core.release();
}

}  // namespace hapticd::rt
