// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "rt/depth_frame.h"
#include "tools/truth/true_scene.h"

namespace hapticd::tools {

/// A scene that the laws are measured on, and what it is called on the command line.
struct AccuracyScene {
  std::string name;
  TrueSceneParameters shape;  ///< at any distance

  bool moves() const { return shape.speed_m_per_s > 0; }
  /// The scene at `distance_m` as the camera sees it with that noise: for `none` a camera with raw units of
  /// about 0.1 mm around it, else a Kinect's.
  TrueScene at(double distance_m, SceneNoise noise, std::uint32_t seed) const;
};

/// Planes, bodies, edges and moving planes; the first is the plane that faces the camera.
const std::vector<AccuracyScene>& accuracyScenes();

/// The way that a moving scene moves towards the camera.
inline constexpr double kAdvance_m = 0.06;

inline constexpr double kFrameRate_hz = 30;
/// Frames that are shown before the HIP moves, as many as the filter takes to settle.
inline constexpr int kSettlingFrames = 12;

/// The images of a scene at 30 frames per second, rendered once and shown to every law.
/// Thread: one at a time.
class FrameReel {
 public:
  /// `first_moving_frame`: up to that one the scene is as at time 0. `scene` outlives the reel.
  FrameReel(TrueScene& scene, SceneNoise noise, int first_moving_frame)
      : scene_(scene), noise_(noise), first_moving_frame_(first_moving_frame) {}

  /// Seconds that the scene has moved by at that frame.
  static double time_s(int frame, int first_moving_frame) {
    return frame > first_moving_frame ? (frame - first_moving_frame) / kFrameRate_hz : 0;
  }

  /// Frame `index`, from 0 on; its sequence number is one more. Still scenes repeat after a while.
  const rt::DepthFrame& frame(int index);

 private:
  TrueScene& scene_;
  SceneNoise noise_;
  int first_moving_frame_;
  std::vector<std::unique_ptr<rt::DepthFrame>> rendered_;
};

}  // namespace hapticd::tools
