// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/camera/kinect_image.h"
#include "drivers/camera/synthetic/edge_errors.h"
#include "drivers/camera/synthetic/noise_pattern.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::drivers {

/// Converts exact raw disparities to the output of an integer sensor. The result is determined by the seed,
/// the frame number and the image.
/// Thread: any; applying does not change the object.  RT: not safe (allocates).
class SensorNoise {
 public:
  /// Properties that differ between devices and rooms.
  struct Parameters {
    NoisePatternParameters pattern{};
    /// Fraction of pixels that flicker between valid and invalid, in patches at fixed positions.
    double flicker_share = 0.1;
    /// Fraction of flying pixels, which show a depth between both sides of an edge, among the measured pixels
    /// at edges: 26 of 3963 in 01_raw11_room_gesture, 30 of 5944 in 02_raw11_desk_near.
    double flying_share = 0.01;
    /// As in 01_raw11_room_gesture, where seven of eight gaps beside a body are on its left.
    ShadowSide shadow_side = ShadowSide::left;
    /// Width of the projector's shadow per raw unit between front and back: f B |a| with f = 594.2 px, B = 75
    /// mm between projector and camera, a = -0.003071 per metre and raw unit.
    double shadow_pixels_per_raw = 0.137;
  };

  /// Returns the parameters of the static room in the recording 03_raw11_room_static.
  static Parameters recorded();
  /// Returns the parameters of two other devices, whose pattern hardly changes from frame to frame.
  static Parameters harsh();

  /// Pixels closer than this have correlated noise: 1 - distance/kCorrelationPixels along each axis.
  static constexpr int kCorrelationPixels = NoisePattern::kWindow;
  /// A pixel is at an edge if its disparity differs from a neighbour's by more than this many raw units; it
  /// is then missing in half of the frames.
  static constexpr float kEdgeJumpRaw = 3;
  /// From this column on, no frame of a real camera has a measurement.
  static constexpr int kFirstDeadColumn = 632;

  explicit SensorNoise(std::uint32_t seed) : SensorNoise(seed, recorded()) {}
  SensorNoise(std::uint32_t seed, const Parameters& parameters);

  const Parameters& parameters() const noexcept { return parameters_; }

  /// Rounds each pixel randomly to one of the two nearest integers such that the mean over frames is exact;
  /// independent between pixels and frames. `exact`: kKinectPixels disparities or kNothingSeen.
  void dither(std::uint64_t frame, std::span<const float> exact, std::uint16_t* raw) const;

  /// Simulates a Kinect v1: the projector's shadow, correlated noise, rounding, missing and flying pixels at
  /// edges, flickering patches, and dead columns.
  void applySensor(std::uint64_t frame, std::span<const float> exact, std::uint16_t* raw) const;

 private:
  // One field of correlated normal noise (mean 0, standard deviation 1) that wraps around, used for flicker;
  // each frame reads it at an offset of its own.
  static constexpr int kFieldWidth = 1024;
  static constexpr int kFieldHeight = 512;

  struct Offset {
    int column;
    int row;
  };
  /// Offsets of a frame into the field.
  struct Offsets {
    Offset flicker;
    Offset weak;
  };
  Offset offset(std::uint64_t frame, std::uint32_t purpose) const;
  float field(Offset offset, int column, int row) const;
  std::uint16_t atEdge(std::uint32_t bits, float disparity, float neighbour, float noise) const;
  void applyRow(std::uint64_t frame, int row, const Offsets& offsets, std::span<const float> lit,
                std::span<const float> noise, std::uint16_t* raw) const;

  std::uint32_t seed_;
  Parameters parameters_;
  float weak_above_;  // threshold of the field exceeded by the fraction flicker_share
  NoisePattern pattern_;
  std::vector<float> field_;
};

}  // namespace hapticd::drivers
