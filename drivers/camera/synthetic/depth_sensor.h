// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "drivers/camera/synthetic/camera_noise.h"
#include "drivers/camera/synthetic/edge_errors.h"
#include "rt/base/parameters.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::drivers {

/// Writes depths in metres, row by row without padding, to frame.raw as the nearest raw values of a camera
/// with any depth law, and no measurement in the padding. Depths that are not above 0 stand for nothing seen.
/// The frame becomes one of the camera. RT: safe.
void deliverDepths(const rt::DepthModelParameters& camera, std::span<const float> depths_m,
                   rt::DepthFrame& frame);

/// The same, but each pixel is rounded randomly to one of the two nearest raw values such that the mean over
/// frames is exact; independent between pixels and frames.
void deliverDithered(const rt::DepthModelParameters& camera, std::uint32_t seed, std::uint64_t frame_number,
                     std::span<const float> depths_m, rt::DepthFrame& frame);

/// Converts exact depths to the output of a stereo or time-of-flight camera that delivers depth, as
/// SensorNoise does for a Kinect v1. The result is determined by the seed, the frame number and the image.
/// Thread: any; applying does not change the object.  RT: not safe (allocates).
class DepthSensor {
 public:
  struct Parameters {
    double baseline_m = 0;   ///< between the imagers of a stereo camera
    double noise_scale = 1;  ///< factor of the standard deviation that the camera states
  };

  DepthSensor(const rt::DepthModelParameters& camera, std::uint32_t seed, const Parameters& parameters);

  /// Rounds each pixel randomly to one of the two nearest raw values. `exact_m`: depths in metres, row by row
  /// without padding, or kNothingSeen.
  void dither(std::uint64_t frame_number, std::span<const float> exact_m, rt::DepthFrame& frame) const;

  /// Simulates the camera: errors at edges, noise, rounding to the depth unit.
  void applySensor(std::uint64_t frame_number, std::span<const float> exact_m, rt::DepthFrame& frame) const;

 private:
  rt::DepthModelParameters camera_;
  std::uint32_t seed_;
  EdgeErrors edges_;
  CameraNoise noise_;
};

}  // namespace hapticd::drivers
