// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/camera/synthetic/edge_errors.h"
#include "rt/base/parameters.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::drivers {

/// The noise of a depth camera, in metres, by the model that the camera states (rt::DepthNoiseParameters):
/// normal, of the standard deviation sigma(Z), alike over windows of correlation_px pixels. The stated share
/// of its variance stands still: it depends on the pixel and on the depth that it sees, so that the same
/// image has the same pattern. The rest is another one in each frame. The result is determined by seed, frame
/// number and image. Thread: any; adding does not change the object.  RT: not safe (allocates).
class CameraNoise {
 public:
  /// Share of the variance of the part that stands still which remains when the scene moves, because it
  /// belongs to the pixel alone. The rest is another one after a change of the depth by two standard
  /// deviations.
  static constexpr double kShareOfPixel = 0.2;

  /// `scale`: factor of the stated standard deviation.
  CameraNoise(const rt::DepthModelParameters& camera, std::uint32_t seed, double scale = 1);

  /// Adds the noise of a frame to the depths of an image in metres, row by row without padding. Depths that
  /// are not above 0 stand for nothing seen and remain; one that noise carries there is no longer seen.
  void addTo(std::uint64_t frame, std::span<float> depths_m) const;

 private:
  void fillPlaces();
  float placeOf(float depth_m) const noexcept;
  void fillCells(std::uint64_t frame, std::span<const float> depths_m, std::span<float> cells) const;

  int width_px_;
  int height_px_;
  int window_px_;
  rt::DepthNoiseParameters noise_;  // scaled
  float near_m_;
  float places_per_m_;
  std::uint32_t standing_salt_;
  std::uint32_t changing_salt_;
  std::vector<float>
      fixed_;  // per cell: the part that belongs to the pixel alone; empty: nothing stands still
  std::vector<float> places_;  // over the depth: distance from near_m in standard deviations
};

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
