// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "rt/depth_model.h"
#include "rt/parameters.h"
#include "rt/vec3.h"
#include "tools/hapticbench/bench_scene.h"

namespace hapticd::tools {

/// The raw values of any camera as the raw disparities in which the core models surfaces
/// (rt::DepthModel::disparity()), not rounded; those of a Kinect v1 are its raw values. A plane in space is a
/// plane in them. Everything is in the camera's frame: x right, y up, -z ahead. Thread: any.
class CameraDisparity {
 public:
  explicit CameraDisparity(const rt::DepthModelParameters& camera);

  const rt::DepthModel& model() const { return model_; }
  int width_px() const { return model_.width_px(); }
  int height_px() const { return model_.height_px(); }
  /// Where a pixel is in the image of a frame.
  std::size_t pixelOf(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(model_.stride_px()) +
           static_cast<std::size_t>(column);
  }

  /// The disparity of a raw value, whether the camera's limits of depth include it or not; NaN if it is no
  /// measurement.
  float of(std::uint16_t raw) const { return of_raw_[raw]; }
  double depth_m(double disparity) const { return 1 / model_.disparity().inverseDepth_per_m(disparity); }
  double ofDepth(double depth_m) const { return model_.disparity().rawOf(depth_m); }
  bool isNearer(double disparity, double than) const {
    return model_.disparity().a_per_m < 0 ? disparity < than : disparity > than;
  }
  /// The point on the ray of (column, row) with that disparity, metres.
  rt::Vec3 pointOf(double column, double row, double disparity) const;

  /// The camera's noise there relative to a Kinect's, for tolerances that are stated in its raw units.
  double noiseScale(double disparity) const { return model_.noiseScale(depth_m(disparity)); }
  /// Standard deviation of a pixel from frame to frame as the camera states it; 0 if it does not.
  double changingNoise(double disparity) const;
  /// One unit of disparity at a depth, metres.
  double unit_m(double depth_m) const { return model_.disparity().unit_m(depth_m); }
  /// Over how many pixels errors are alike.
  double correlation_px() const { return model_.parameters().noise.correlation_px; }

 private:
  rt::DepthModel model_;
  std::vector<float> of_raw_;
};

/// The camera of a sequence; one that does not state its noise, and is no Kinect v1, has what the frames show
/// where the scene rests, for tolerances.
rt::DepthModelParameters cameraWithNoise(const BenchSequence& sequence);

}  // namespace hapticd::tools
