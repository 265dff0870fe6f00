#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "rt/depth_frame.h"

namespace hapticd::drivers {

/// What an exact disparity is when the scene shows nothing at a pixel.
inline constexpr float kNothingSeen = -1;

/// Turns exact raw disparities into what an integer sensor delivers. The same seed, frame number and image
/// always give the same result.
/// Thread: any, applying does not change the object.  RT: not safe (constructed at start).
class SensorNoise {
 public:
  /// Standard deviation of the noise before rounding, raw units; rounding makes it sqrt(0.5^2 + 1/12) = 0.58,
  /// as measured on real cameras between 0.4 and 0.8 m.
  static constexpr double kSigmaRaw = 0.5;
  /// Pixels closer than this share their noise: correlation 1 - distance/kCorrelationPixels along each axis.
  static constexpr int kCorrelationPixels = 9;
  /// Share of the pixels that flicker between valid and invalid, in patches that stay where they are.
  static constexpr double kFlickerShare = 0.1;
  /// A pixel flickers also where its disparity differs from a neighbour's by more than this many raw units.
  static constexpr float kEdgeJumpRaw = 3;
  /// The columns from here on hold no measurement in any frame of a real camera.
  static constexpr int kFirstDeadColumn = 632;

  explicit SensorNoise(std::uint32_t seed);

  /// Each pixel takes one of the two nearest integers, so that the mean over frames is exact; independent
  /// between pixels and frames. `exact`: kFramePixels disparities or kNothingSeen.
  void dither(std::uint64_t frame, std::span<const float> exact, std::uint16_t* raw) const;

  /// Correlated noise, rounding, flicker and dead columns of a Kinect v1. No shadows of the projector: on
  /// which side of an edge they lie depends on the camera's mounting and mirroring.
  void applySensor(std::uint64_t frame, std::span<const float> exact, std::uint16_t* raw) const;

 private:
  // One field of correlated normal noise (mean 0, s.d. 1) that wraps around; a frame sees it at an offset of
  // its own.
  static constexpr int kFieldWidth = 1024;
  static constexpr int kFieldHeight = 512;

  struct Offset {
    int column;
    int row;
  };
  Offset offset(std::uint64_t frame, std::uint32_t purpose) const;
  const float* fieldRow(Offset offset, int row) const;

  std::uint32_t seed_;
  std::vector<float> field_;
};

}  // namespace hapticd::drivers
