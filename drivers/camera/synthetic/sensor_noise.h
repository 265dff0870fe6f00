// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/camera/synthetic/noise_pattern.h"
#include "drivers/camera/synthetic/nothing_seen.h"
#include "drivers/camera/synthetic/projector_shadow.h"
#include "rt/depth_frame.h"

namespace hapticd::drivers {

/// Turns exact raw disparities into what an integer sensor delivers. The same seed, frame number and image
/// always give the same result.
/// Thread: any, applying does not change the object.  RT: not safe (allocates).
class SensorNoise {
 public:
  /// What differs from device to device and from room to room.
  struct Parameters {
    NoisePatternParameters pattern{};
    /// Share of the pixels that flicker between valid and invalid, in patches that stay where they are.
    double flicker_share = 0.1;
    /// Of the pixels at an edge that are measured at all, those that show something between both sides: 26 of
    /// 3963 in 01_raw11_room_gesture, 30 of 5944 in 02_raw11_desk_near.
    double flying_share = 0.01;
    /// As in 01_raw11_room_gesture, where seven of eight gaps beside a body are at its left.
    ShadowSide shadow_side = ShadowSide::left;
    /// Width of the projector's shadow per raw unit between front and back: f B |a| with f = 594.2 px,
    /// B = 75 mm between projector and camera, a = -0.003071 per metre and raw unit.
    double shadow_pixels_per_raw = 0.137;
  };

  /// The resting room of the recording 03_raw11_room_static.
  static Parameters recorded();
  /// Two other devices, whose pattern hardly changes from frame to frame.
  static Parameters harsh();

  /// Pixels closer than this share their noise: correlation 1 - distance/kCorrelationPixels along each axis.
  static constexpr int kCorrelationPixels = NoisePattern::kWindow;
  /// At an edge a pixel's disparity differs from a neighbour's by more than this many raw units; it is
  /// missing in half of the frames.
  static constexpr float kEdgeJumpRaw = 3;
  /// The columns from here on hold no measurement in any frame of a real camera.
  static constexpr int kFirstDeadColumn = 632;

  explicit SensorNoise(std::uint32_t seed) : SensorNoise(seed, recorded()) {}
  SensorNoise(std::uint32_t seed, const Parameters& parameters);

  const Parameters& parameters() const noexcept { return parameters_; }

  /// Each pixel takes one of the two nearest integers, so that the mean over frames is exact; independent
  /// between pixels and frames. `exact`: kFramePixels disparities or kNothingSeen.
  void dither(std::uint64_t frame, std::span<const float> exact, std::uint16_t* raw) const;

  /// What a Kinect v1 makes of the image: the projector's shadow, correlated noise, rounding, edges whose
  /// pixels are missing or fly, patches that flicker, and dead columns.
  void applySensor(std::uint64_t frame, std::span<const float> exact, std::uint16_t* raw) const;

 private:
  // One field of correlated normal noise (mean 0, s.d. 1) that wraps around, for what flickers; a frame sees
  // it at an offset of its own.
  static constexpr int kFieldWidth = 1024;
  static constexpr int kFieldHeight = 512;

  struct Offset {
    int column;
    int row;
  };
  /// Where a frame's fields begin.
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
  float weak_above_;  // of the field: flicker_share lies above
  NoisePattern pattern_;
  std::vector<float> field_;
};

}  // namespace hapticd::drivers
