// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "rt/base/parameters.h"

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

}  // namespace hapticd::drivers
