// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/camera/synthetic/depth_sensor.h"
#include "drivers/camera/synthetic/scene_camera.h"
#include "drivers/camera/synthetic/sensor_noise.h"
#include "rt/base/parameters.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::tools {

/// Like the Kinect of Table I, but its raw values 0..2046 are spread evenly in 1/Z over `near_m`..`far_m`
/// alone: raw 0 is near_m, raw 2046 is far_m, raw 1023 is the depth at the mean of 1/near_m and 1/far_m.
/// A range of 0.2 m makes a raw unit about 0.1 mm. 0 < near_m < far_m.  Thread: any.
rt::DepthModelParameters fineDepthModel(double near_m, double far_m);

/// Like fineDepthModel(), around `middle_m`, which is exactly raw 1023; 1/Z extends equally to both sides of
/// it, so far that `middle_m` + `beyond_m` is in sight. 0 < beyond_m < middle_m.
rt::DepthModelParameters fineDepthModelAround(double middle_m, double beyond_m);

/// A depth camera with its usual name, as a driver would describe it.
struct NamedCamera {
  std::string name;
  rt::DepthModelParameters camera;
};

/// config::stereoCamera() with a depth unit and limits.
rt::DepthModelParameters stereoCamera(int width_px, int height_px, double field_of_view_deg,
                                      double baseline_m, double unit_m, double near_m, double far_m);
/// config::timeOfFlightCamera().
rt::DepthModelParameters timeOfFlightCamera(int width_px, int height_px);
/// A Kinect v1 with the noise of its raw disparity, which the core does not need to be given.
rt::DepthModelParameters kinectWithNoise();

/// Depth in metres along the optical axis at a pixel; 0: nothing is measured.
using DepthAt = std::function<double(double column, double row)>;

/// Depth of a plane through (0, 0, -distance), tilted about the camera's x axis.
DepthAt tiltedPlane(const rt::DepthModelParameters& camera, double distance_m, double tilt_rad);
/// Depth of the front of a ball around `centre_m_in_camera`, and nothing beside it.
DepthAt ball(const rt::DepthModelParameters& camera, const rt::Vec3& centre_m_in_camera, double radius_m);

/// Successive frames of a camera and a scene at rest, with the noise of the synthetic camera by the camera's
/// own model: a part of it stands still, the rest is another one in each frame. Edges have no errors.
/// Thread: one at a time.
class FrameSequence {
 public:
  /// `seed`: of the noise; 0: none, only rounding to raw values.
  FrameSequence(const rt::DepthModelParameters& camera, const DepthAt& depth, std::uint32_t seed);

  /// Returns the next frame; the first has the sequence number 1.
  std::unique_ptr<rt::DepthFrame> next();

 private:
  rt::DepthModelParameters camera_;
  std::vector<float> exact_m_;
  std::optional<drivers::CameraNoise> noise_;
  std::uint64_t number_ = 0;
};

/// Returns the first frame of a FrameSequence: with another seed all of its noise is another one.
std::unique_ptr<rt::DepthFrame> frameOf(const rt::DepthModelParameters& camera, const DepthAt& depth,
                                        std::uint32_t seed = 0);

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
