// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "config/settings.h"
#include "drivers/camera/synthetic/sensor_noise.h"
#include "rt/depth_frame.h"
#include "rt/parameters.h"
#include "rt/vec3.h"

namespace hapticd::drivers {

/// A scene whose true surface is known, and its image in a camera that the given depth model describes. All
/// of it in the camera's frame: x right, y up, looking along -z; D stands for `distance_m`, R for the radius.
/// - plane: through (0, 0, -D), turned by `tilt_rad` about the x axis (positive: its upper part is nearer);
/// solid behind.
/// - sphere: radius R around (0, 0, -D), nothing behind it.
/// - moving_sphere: the same at x = amplitude * sin(2 pi t / period), sliding along a wall that it touches,
/// the
///   fronto-parallel plane at depth D + R.
/// - edge: the left half (x <= 0) of the plane as a solid block that ends at x = 0, nothing beside it.
/// Noise `off`: each disparity is rounded to the nearest integer. `quantised`: SensorNoise::dither().
/// `sensor` and `harsh`: SensorNoise::applySensor() with the parameters recorded() and harsh(). A surface
/// nearer than near_m or farther than far_m is never measured, nor is a raw value delivered that stands for
/// such a depth. Thread: one at a time (render uses a buffer of the object).  RT: not safe.
class AnalyticScene {
 public:
  AnalyticScene(const config::SyntheticSettings& settings, const rt::DepthModelParameters& depth_model);

  /// Metres from `p_m_in_camera` to the scene's surface at time `t_s`, positive in free space, negative
  /// inside. Inside moving_sphere's union of ball and wall it is the depth in the deeper one, a lower bound.
  double signedDistance(const rt::Vec3& p_m_in_camera, double t_s) const;

  /// True depth Z in metres along the ray through the middle of pixel (column, row); 0 where the ray meets
  /// nothing. Not limited by near and far.
  double trueDepth(int column, int row, double t_s) const;

  /// Fills frame.raw with what the camera sees at `t_s`. The noise depends on the number of the frame period
  /// that `t_s` lies in, and on the seed.
  void render(double t_s, rt::DepthFrame& frame);

 private:
  rt::Vec3 sphereCentre(double t_s) const;
  double inversePlaneDepth(double ray_y) const;
  double inverseSphereDepth(double ray_x, double ray_y, const rt::Vec3& centre) const;
  double inverseDepth(double ray_x, double ray_y, const rt::Vec3& centre) const;
  float exactDisparity(double inverse_depth) const;
  void removeOutsideLimits(std::uint16_t* raw) const;

  config::SyntheticSettings settings_;
  rt::DepthModelParameters model_;
  SensorNoise noise_;
  double inverse_distance_per_m_;               // 1/Z of the plane on the optical axis
  double inverse_distance_slope_per_m_;         // and its change per unit of ray_y
  std::array<double, rt::kFrameWidth> ray_x_;   // of the rays (x, y, -1) through each column
  std::array<double, rt::kFrameHeight> ray_y_;  // and each row
  std::uint16_t raw_first_ = 1;                 // raw values that stand for depths from near to far
  std::uint16_t raw_last_ = 0;
  std::vector<float> exact_;
};

}  // namespace hapticd::drivers
