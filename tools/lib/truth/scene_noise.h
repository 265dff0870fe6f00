// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string_view>

#include "drivers/camera/synthetic/depth_sensor.h"
#include "drivers/camera/synthetic/scene_camera.h"
#include "drivers/camera/synthetic/sensor_noise.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::tools {

enum class SceneNoise : std::uint8_t {
  none,       ///< rounded to the camera's unit; the camera of fineDepthModel() makes that next to nothing
  quantised,  ///< rounded to the camera's unit
  sensor,     ///< SensorNoise::recorded(): the noise of the resting room 03_raw11_room_static
  harsh,      ///< SensorNoise::harsh(): two other devices, whose pattern hardly changes between frames
};
inline constexpr std::array kAllNoises{SceneNoise::none, SceneNoise::quantised, SceneNoise::sensor,
                                       SceneNoise::harsh};
std::string_view nameOf(SceneNoise noise);

/// The noise of a real sensor, not only rounding.
constexpr bool isSensorNoise(SceneNoise noise) {
  return noise > SceneNoise::quantised;
}
/// harsh() for `harsh`, else recorded().
drivers::SensorNoise::Parameters sensorParameters(SceneNoise noise);

/// The noise of a scene's camera: of a Kinect v1, or of a camera that delivers depth by its own model, twice
/// as much where it is harsh. Each kind is made when it is first needed.
/// Thread: one at a time.  RT: not safe.
class SceneSensor {
 public:
  /// `leaves_shadows`: the noise of a Kinect leaves out what the projector does not reach.
  explicit SceneSensor(std::uint32_t seed, bool leaves_shadows = true)
      : seed_(seed), leaves_shadows_(leaves_shadows) {}

  /// Delivers the newest measurement of the camera, always the same one, as frame `frame_number` (from 1 on),
  /// which chooses the noise.
  void deliver(const drivers::SceneCamera& camera, std::uint64_t frame_number, SceneNoise noise,
               rt::DepthFrame& frame);

 private:
  std::uint32_t seed_;
  bool leaves_shadows_;
  std::map<SceneNoise, drivers::SensorNoise> sensors_;
  std::map<SceneNoise, drivers::CameraNoise> depth_noises_;
};

}  // namespace hapticd::tools
