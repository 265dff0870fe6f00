// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "drivers/camera/synthetic/nothing_seen.h"
#include "rt/depth_frame.h"
#include "rt/parameters.h"
#include "rt/vec3.h"

namespace hapticd::drivers {

/// The depth camera in front of a scene whose depths are known: the ray through each pixel, the exact
/// disparity of what the ray meets, rounding, and the limits of measurement. Noise is added by SensorNoise.
/// Everything is in the camera frame: x right, y up, looking along -z. Thread: one at a time (measure() uses
/// a buffer of the object).  RT: not safe.
class SceneCamera {
 public:
  explicit SceneCamera(const rt::DepthModelParameters& model);

  const rt::DepthModelParameters& model() const noexcept { return model_; }

  /// Returns the ray through a point of the image, at depth 1 m; integers are the middles of pixels.
  rt::Vec3 rayThrough(double column, double row) const noexcept;

  /// Returns the disparity of 1/Z in raw units, not rounded; kNothingSeen for a depth outside near_m..far_m,
  /// for one that no raw value stands for, and for 1/Z <= 0, where the ray meets nothing.
  float exactDisparity(double inverse_depth_per_m) const noexcept;

  /// Measures a scene: `inverseDepthOf(ray)` returns 1/Z per metre on the ray through the middle of each
  /// pixel.
  template <typename InverseDepthOf>
  void measure(const InverseDepthOf& inverseDepthOf) {
    float* exact = exact_.data();
    for (const double ray_y : ray_y_) {
      for (const double ray_x : ray_x_) *exact++ = exactDisparity(inverseDepthOf(rt::Vec3{ray_x, ray_y, -1}));
    }
  }

  /// The exact disparities of the newest measurement, row by row, kKinectPixels of them; a scene that is not
  /// measured ray by ray writes them itself.
  std::vector<float>& exact() noexcept { return exact_; }
  const std::vector<float>& exact() const noexcept { return exact_; }

  /// Writes the newest measurement to frame.raw, each disparity rounded to the nearest integer.
  void deliverRounded(rt::DepthFrame& frame) const;

  /// Marks raw values of depths outside near_m..far_m, to which noise may have carried a pixel, as not
  /// measured.
  void removeOutsideLimits(rt::DepthFrame& frame) const;

 private:
  rt::DepthModelParameters model_;
  std::array<double, kKinectWidth> ray_x_;   // x of the rays (x, y, -1) through each column
  std::array<double, kKinectHeight> ray_y_;  // y of the rays through each row
  std::uint16_t raw_first_ = 1;              // first raw value with a depth from near_m to far_m
  std::uint16_t raw_last_ = 0;               // last raw value with a depth from near_m to far_m
  std::vector<float> exact_;
};

}  // namespace hapticd::drivers
