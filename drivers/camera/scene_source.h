// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <unordered_map>
#include <vector>

#include "rt/base/parameters.h"
#include "rt/depth/depth_model.h"
#include "rt/modelling/scene_builder.h"
#include "rt/scene/scene.h"

namespace hapticd::drivers {

/// Makes models and builders for the camera that delivers the frames, and new ones when another camera
/// delivers them or the camera changes its mode.
/// Thread: one (the scene thread), except that scenes refer to models of this object from any thread: it
/// outlives the scenes and keeps every model.
class SceneSource {
 public:
  /// `camera`: the camera until the first frame; it has no fault, see rt::faultOf(). `grid`: of the HIP's
  /// reach.  RT: not safe.
  SceneSource(const rt::DepthModelParameters& camera, const rt::PoseParameters& T_world_camera,
              const rt::GridParameters& grid);

  /// Largest number of different cameras and modes, because the models of all of them are kept.
  static constexpr std::size_t kMaxModels = 16;

  /// Prepares for frames of a camera; returns false if it has a fault or is one too many. RT: safe if
  /// it is the camera of the frame before.
  bool follow(const rt::DepthModelParameters& camera);

  rt::SceneBuilder& builder() noexcept { return *builder_; }
  const rt::DepthModel& model() const noexcept { return builder_->model(); }
  const rt::SceneBuilder& builder() const noexcept { return *builder_; }

  /// Attaches a scene, which no other thread reads now, to memory of the size that builder() needs.
  /// RT: safe if it has been attached since the camera changed.
  void attach(rt::Scene& scene);

 private:
  const rt::DepthModel& modelOf(const rt::DepthModelParameters& camera);

  rt::PoseParameters T_world_camera_;
  rt::GridParameters grid_;
  std::vector<std::unique_ptr<rt::DepthModel>> models_;
  std::unique_ptr<rt::SceneBuilder> builder_;
  struct Attached {
    const rt::DepthModel* model;
    rt::SceneStorage storage;
  };
  std::unordered_map<const rt::Scene*, std::unique_ptr<Attached>> attached_;
};

}  // namespace hapticd::drivers
