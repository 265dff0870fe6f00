// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/scene_source.h"

#include <algorithm>

namespace hapticd::drivers {

SceneSource::SceneSource(const rt::DepthModelParameters& camera, const rt::PoseParameters& T_world_camera,
                         const rt::GridParameters& grid)
    : T_world_camera_(T_world_camera),
      grid_(grid),
      builder_(std::make_unique<rt::SceneBuilder>(modelOf(camera), grid)) {}

const rt::DepthModel& SceneSource::modelOf(const rt::DepthModelParameters& camera) {
  const auto known =
      std::ranges::find_if(models_, [&camera](const auto& model) { return model->parameters() == camera; });
  if (known != models_.end()) return **known;
  return *models_.emplace_back(std::make_unique<rt::DepthModel>(camera, T_world_camera_));
}

bool SceneSource::follow(const rt::DepthModelParameters& camera) {
  if (camera == model().parameters()) return true;
  if (rt::faultOf(camera) != rt::CameraFault::none) return false;
  const bool is_known =
      std::ranges::any_of(models_, [&](const auto& model) { return model->parameters() == camera; });
  if (!is_known && models_.size() >= kMaxModels) return false;
  builder_ = std::make_unique<rt::SceneBuilder>(modelOf(camera), grid_);
  return true;
}

void SceneSource::attach(rt::Scene& scene) {
  std::unique_ptr<Attached>& attached = attached_[&scene];
  if (attached && attached->model == &model()) return;
  attached = std::make_unique<Attached>(
      &model(), rt::SceneStorage(builder_->shape(), builder_->pointCapacity(), model()));
  scene = rt::Scene{};
  attached->storage.attachTo(scene);
}

}  // namespace hapticd::drivers
