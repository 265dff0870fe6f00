// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "rt/depth_frame.h"
#include "tools/lib/truth/true_scene.h"

namespace hapticd::tools {

/// A scene on which the laws are measured, with its name on the command line.
struct AccuracyScene {
  std::string name;
  TrueSceneParameters shape;  ///< at any distance

  /// The scene at `distance_m` as the camera sees it with that noise: for `none` a camera with raw units of
  /// about 0.1 mm around it, else a Kinect's.
  TrueScene at(double distance_m, SceneNoise noise, std::uint32_t seed) const;
};

inline const std::string& nameOf(const AccuracyScene& scene) {
  return scene.name;
}

/// Planes, bodies and edges; the first is the plane that faces the camera.
const std::vector<AccuracyScene>& accuracyScenes();

inline constexpr double kFrameRate_hz = 30;
/// Number of frames shown before the HIP moves, which the filter needs to settle.
inline constexpr int kSettlingFrames = 12;

/// The images of a scene at 30 frames per second, rendered once and shown to every law.
/// Thread: one at a time.
class FrameReel {
 public:
  /// `scene` outlives the reel.
  FrameReel(TrueScene& scene, SceneNoise noise) : scene_(scene), noise_(noise) {}

  /// Frame `index`, from 0 on; its sequence number is one more. The images repeat after a while.
  const rt::DepthFrame& frame(int index);

 private:
  TrueScene& scene_;
  SceneNoise noise_;
  std::vector<std::unique_ptr<rt::DepthFrame>> rendered_;
};

}  // namespace hapticd::tools
