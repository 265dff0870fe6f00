// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "config/settings/settings.h"
#include "drivers/camera/synthetic/depth_sensor.h"
#include "drivers/camera/synthetic/scene_camera.h"
#include "drivers/camera/synthetic/sensor_noise.h"
#include "rt/base/parameters.h"
#include "rt/base/vec3.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::drivers {

/// Camera that the driver `synthetic` plays.
enum class PlayedCamera { kinect, stereo, time_of_flight };
constexpr auto wordsOf(PlayedCamera) {
  return rt::words<PlayedCamera>("kinect", "stereo", "time_of_flight");
}
enum class SyntheticScene { plane, sphere, moving_sphere, edge };
constexpr auto wordsOf(SyntheticScene) {
  return rt::words<SyntheticScene>("plane", "sphere", "moving_sphere", "edge");
}
enum class SyntheticNoise { off, quantised, sensor, harsh };
constexpr auto wordsOf(SyntheticNoise) {
  return rt::words<SyntheticNoise>("off", "quantised", "sensor", "harsh");
}

/// The analytic scene of the driver `synthetic`, in front of a camera that looks along -z.
struct SyntheticSettings {
  PlayedCamera played = PlayedCamera::kinect;
  SyntheticScene scene = SyntheticScene::moving_sphere;
  SyntheticNoise noise = SyntheticNoise::sensor;
  double distance_m = 1.0;  ///< from the camera to the plane, or to the sphere's centre
  double tilt_rad = 0;      ///< of the plane about the camera's x axis
  double sphere_radius_m = 0.1;
  double motion_amplitude_m = 0.1;  ///< of the moving sphere, along x
  double motion_period_s = 4;
  double frame_rate_hz = 30;
  int seed = 1;  ///< of the noise
};

/// A scene with a known true surface, and its image in a camera described by the given depth model.
/// Everything is in the camera frame: x right, y up, looking along -z. D stands for `distance_m`, R for the
/// radius.
/// - plane: through (0, 0, -D), rotated by `tilt_rad` about the x axis (positive: its upper part is nearer);
/// solid behind.
/// - sphere: radius R around (0, 0, -D), nothing behind it.
/// - moving_sphere: the same at x = amplitude * sin(2 pi t / period), sliding along a wall that it touches,
/// the fronto-parallel plane at depth D + R.
/// - edge: the left half (x <= 0) of the plane as a solid block that ends at x = 0, nothing beside it.
///
/// Noise `off`: each pixel is rounded to the nearest raw value. `quantised`: dither() of SensorNoise for a
/// camera that delivers disparities (a Kinect v1), of DepthSensor for one that delivers depth. `sensor` and
/// `harsh`: SensorNoise::applySensor() with the parameters recorded() and harsh(); DepthSensor::applySensor()
/// with the noise that the camera states, and twice that. A surface nearer than near_m or farther than far_m
/// is never measured, and no raw value of such a depth is delivered.
///
/// Thread: one at a time (render() uses a buffer of the camera).  RT: not safe.
class AnalyticScene {
 public:
  AnalyticScene(const SyntheticSettings& settings, const rt::DepthModelParameters& depth_model);

  /// Returns the distance in metres from `p_m_in_camera` to the scene's surface at time `t_s`, positive in
  /// free space, negative inside. Inside the union of ball and wall of moving_sphere it is the larger of both
  /// depths, a lower bound.
  double signedDistance(const rt::Vec3& p_m_in_camera, double t_s) const;

  /// Returns the true depth Z in metres along the ray through the middle of pixel (column, row); 0 where the
  /// ray meets nothing. Not limited by near_m and far_m.
  double trueDepth(int column, int row, double t_s) const;

  /// Renders the camera's image at `t_s` to frame.raw, and the camera to frame.camera. The noise depends on
  /// the index of the frame period that contains `t_s` and on the seed.
  void render(double t_s, rt::DepthFrame& frame);

 private:
  rt::Vec3 sphereCentre(double t_s) const;
  double inversePlaneDepth(const rt::Vec3& ray) const;
  double inverseSphereDepth(const rt::Vec3& ray, const rt::Vec3& centre) const;
  double inverseDepth(const rt::Vec3& ray, const rt::Vec3& centre) const;
  void renderDisparities(std::uint64_t number, rt::DepthFrame& frame) const;
  void renderDepths(std::uint64_t number, rt::DepthFrame& frame) const;

  SyntheticSettings settings_;
  SceneCamera camera_;
  std::optional<SensorNoise> kinect_;        // of a camera that delivers disparities
  std::optional<DepthSensor> depth_sensor_;  // of a camera that delivers depth
  double inverse_distance_per_m_;            // 1/Z of the plane on the optical axis
  double inverse_distance_slope_per_m_;      // change of 1/Z of the plane per unit of the ray's y
};

}  // namespace hapticd::drivers
