// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "drivers/camera/synthetic/edge_errors.h"
#include "rt/base/parameters.h"
#include "rt/base/vec3.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::drivers {

/// The depth camera in front of a scene whose depths are known: the ray through each pixel, the exact value
/// of what the ray meets, rounding, and the limits of measurement. The exact value is the raw disparity of a
/// camera that delivers disparities, and the depth in metres of one that delivers depth. Noise is added by
/// SensorNoise and DepthSensor.
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

  /// Returns 1/(1/Z) in metres; kNothingSeen for a depth outside near_m..far_m, and for 1/Z <= 0.
  float exactDepth_m(double inverse_depth_per_m) const noexcept;

  /// Measures a scene: `inverseDepthOf(ray)` returns 1/Z per metre on the ray through the middle of each
  /// pixel.
  template <typename InverseDepthOf>
  void measure(const InverseDepthOf& inverseDepthOf) {
    const bool is_linear = model_.law == rt::DepthLawKind::linear;
    float* exact = exact_.data();
    for (const double ray_y : ray_y_) {
      for (const double ray_x : ray_x_) {
        const double inverse_depth = inverseDepthOf(rt::Vec3{ray_x, ray_y, -1});
        *exact++ = is_linear ? exactDepth_m(inverse_depth) : exactDisparity(inverse_depth);
      }
    }
  }

  /// The exact values of the newest measurement, row by row without padding; a scene that is not measured ray
  /// by ray writes them itself.
  std::vector<float>& exact() noexcept { return exact_; }
  const std::vector<float>& exact() const noexcept { return exact_; }

  /// Writes the newest measurement to frame.raw, each value rounded to the nearest raw one.
  void deliverRounded(rt::DepthFrame& frame) const;

  /// Marks raw values of depths outside near_m..far_m, to which noise may have carried a pixel, as not
  /// measured.
  void removeOutsideLimits(rt::DepthFrame& frame) const;

 private:
  rt::DepthModelParameters model_;
  std::vector<double> ray_x_;    // x of the rays (x, y, -1) through each column
  std::vector<double> ray_y_;    // y of the rays through each row
  std::uint16_t raw_first_ = 1;  // first raw value with a depth from near_m to far_m
  std::uint16_t raw_last_ = 0;   // last raw value with a depth from near_m to far_m
  std::vector<float> exact_;
};

}  // namespace hapticd::drivers
