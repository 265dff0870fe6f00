// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hapticd::drivers {

/// Standard deviations before rounding, raw units, of the parts of a depth camera's noise.
struct NoisePatternParameters {
  /// The part that a resting camera shows again in every frame of a resting scene: each pixel's error depends
  /// on the disparity that the pixel sees.
  double standing_raw = 0;
  /// Shares of the standing part's variance: what depends on the pixel alone and so stays when the scene
  /// moves, and what changes slowly with the disparity. The rest is another one after one raw unit. So what
  /// is left of the pattern's correlation is 0.5 after a motion of one raw unit and 0.2 after 60.
  double share_of_pixel = 0.2;
  double share_of_slow = 0.3;
  /// The part that drifts; its autocorrelation is exp(-k / drift_frames) after k frames.
  double drift_raw = 0;
  double drift_frames = 1;
  /// The part that is independent from frame to frame.
  double fast_raw = 0;
  /// The camera's distortion: it belongs to the pixel alone and extends over kCoarseWindow pixels.
  double coarse_raw = 0;

  double variance() const noexcept {
    return standing_raw * standing_raw + drift_raw * drift_raw + fast_raw * fast_raw +
           coarse_raw * coarse_raw;
  }
};

/// Noise as a matching window makes it: every pixel's error is the mean of the errors of the cells (one per
/// pixel) of a square window around it, so that neighbours share most of their errors; correlation
/// (1 - |dx| / kWindow)(1 - |dy| / kWindow). A cell's error depends on the seed, the cell, the disparity seen
/// there (standing part) and the frame's number (drift and fast part). The distortion is another such image,
/// with a larger window. Thread: any, rendering does not change the object.  RT: not safe (allocates).
class NoisePattern {
 public:
  /// Side of the matching window, pixels.
  static constexpr int kWindow = 9;
  /// The same for the distortion.
  static constexpr int kCoarseWindow = 33;
  /// A part of a cell's error that depends on the disparity goes over from one random value to the next
  /// within so many raw units; values two or more spacings apart share nothing.
  static constexpr float kFastSpacing_raw = 0.5F;
  static constexpr float kSlowSpacing_raw = 30;

  NoisePattern(std::uint32_t seed, const NoisePatternParameters& parameters);

  /// What is left of the standing part's correlation after a change of the disparity by `change_raw` at every
  /// pixel, in the mean over all disparities.
  static double standingCorrelation(const NoisePatternParameters& parameters, double change_raw);

  /// The noise of frame `frame` (taken modulo 65536) on an image of exact disparities, raw units; both
  /// rt::kFramePixels long. Windows continue at the opposite border of the image.
  void render(std::uint64_t frame, std::span<const float> exact, std::span<float> noise) const;

 private:
  /// How long a cell's drift keeps one random value, and where in that time frame 0 lies.
  struct Epoch {
    float per_frame;
    float phase;
  };

  void fillCells(std::uint64_t frame, std::span<const float> exact, std::span<float> cells) const;

  NoisePatternParameters parameters_;
  std::uint32_t standing_salt_;
  std::uint32_t slow_salt_;
  std::uint32_t drift_salt_;
  std::uint32_t fast_salt_;
  std::vector<float> fixed_;   // per cell: the standing part's share of the pixel
  std::vector<float> coarse_;  // per pixel; empty without distortion
  std::vector<Epoch> epochs_;  // per cell; empty without drift
};

}  // namespace hapticd::drivers
