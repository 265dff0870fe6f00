// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "drivers/camera/kinect_image.h"

namespace hapticd::drivers {

/// A fixed bijection of 64 bits that spreads every input bit over all output bits (splitmix64's finaliser).
constexpr std::uint64_t scramble(std::uint64_t bits) noexcept {
  bits += 0x9e3779b97f4a7c15U;
  bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9U;
  bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebU;
  return bits ^ (bits >> 31);
}

/// The same for 32 bits, cheap enough for every pixel.
constexpr std::uint32_t scramble32(std::uint32_t bits) noexcept {
  bits = (bits ^ (bits >> 16)) * 0x85ebca6bU;
  bits = (bits ^ (bits >> 13)) * 0xc2b2ae35U;
  return bits ^ (bits >> 16);
}

/// Returns random bits determined by a seed, a purpose and a number.
constexpr std::uint64_t bitsFor(std::uint32_t seed, std::uint32_t purpose, std::uint64_t number) noexcept {
  return scramble(scramble((std::uint64_t{seed} << 32) | purpose) ^ number);
}

/// Odd factors, so that distinct cells and distinct levels stay distinct.
inline constexpr std::uint32_t kCellFactor = 0x9e3779b9U;
inline constexpr std::uint32_t kLevelFactor = 0x85157af5U;

/// A random value that depends on a place, such as a disparity: at each whole number it is another one, and
/// in between it passes from one to the next. Its variance is 1 everywhere if that of the values is. Thread:
/// any.  RT: safe after construction.
class RandomLevels {
 public:
  RandomLevels() {
    for (int i = 0; i < kPhases; ++i) {
      const double angle = (i + 0.5) / kPhases * std::numbers::pi / 2;
      weights_[static_cast<std::size_t>(i)] = {static_cast<float>(std::cos(angle)),
                                               static_cast<float>(std::sin(angle))};
    }
  }

  /// Returns the value of a cell at `place` >= 0. `valueOf(bits)` makes a value of random bits.
  template <typename ValueOf>
  float at(std::uint32_t cell, float place, const ValueOf& valueOf) const noexcept {
    const auto level = static_cast<std::uint32_t>(place);
    const float fraction = place - static_cast<float>(level);
    const Weights& weight = weights_[static_cast<std::size_t>(fraction * kPhases) % kPhases];
    const std::uint32_t here = cell + level * kLevelFactor;
    return weight.here * valueOf(scramble32(here)) + weight.next * valueOf(scramble32(here + kLevelFactor));
  }

 private:
  static constexpr int kPhases = 256;
  /// Cosine and sine of a phase that runs from 0 to a right angle.
  struct Weights {
    float here;
    float next;
  };
  std::array<Weights, kPhases> weights_{};
};

/// Turns independent cells of variance 1, one per pixel, into an image of variance 1 whose pixels share the
/// cells of a square window, as the errors of matching by windows do. The image wraps around; `width` and
/// `height` are at least `window`. RT: not safe (allocates).
void smoothOverWindow(int window, int width, int height, std::span<const float> cells,
                      std::span<float> image);

/// Standard deviations of the components of a depth camera's noise, before rounding, in raw units.
struct NoisePatternParameters {
  /// Static component, which a resting camera repeats in every frame of a resting scene: the error of a pixel
  /// depends on the disparity that it sees.
  double static_raw = 0;
  /// Fractions of the static component's variance: the part that depends only on the pixel, and so remains
  /// when the scene moves, and the part that changes slowly with the disparity. The rest changes within one
  /// raw unit. The resulting correlation is 0.5 after a motion of one raw unit and 0.2 after 60.
  double share_of_pixel = 0.2;
  double share_of_slow = 0.3;
  /// Drifting component; its autocorrelation after k frames is exp(-k / drift_frames).
  double drift_raw = 0;
  double drift_frames = 1;
  /// Component that is independent from frame to frame.
  double fast_raw = 0;
  /// Distortion of the camera: it depends only on the pixel and is correlated over kCoarseWindow pixels.
  double coarse_raw = 0;

  /// Returns the variance of the sum of all components.
  double variance() const noexcept {
    return static_raw * static_raw + drift_raw * drift_raw + fast_raw * fast_raw + coarse_raw * coarse_raw;
  }
};

/// Noise of a matching window: the error of each pixel is the mean of the errors of the cells (one per pixel)
/// in a square window around it, so that adjacent pixels share most of their errors; the correlation is (1 -
/// |dx| / kWindow)(1 - |dy| / kWindow). The error of a cell depends on the seed, the cell, the disparity
/// there (static component) and the frame number (drifting and fast components). The distortion is generated
/// in the same way with a larger window.
/// Thread: any; rendering does not change the object.  RT: not safe (allocates).
class NoisePattern {
 public:
  /// Side length of the matching window in pixels.
  static constexpr int kWindow = 9;
  /// Side length of the distortion's window in pixels.
  static constexpr int kCoarseWindow = 33;
  /// The disparity-dependent part of a cell's error changes from one random value to the next within this
  /// many raw units; values two or more spacings apart are independent.
  static constexpr float kFastSpacing_raw = 0.5F;
  static constexpr float kSlowSpacing_raw = 30;

  NoisePattern(std::uint32_t seed, const NoisePatternParameters& parameters);

  /// Returns the remaining correlation of the static component after a change of the disparity by
  /// `change_raw` at every pixel, averaged over all disparities.
  static double staticCorrelation(const NoisePatternParameters& parameters, double change_raw);

  /// Computes the noise of frame `frame` (modulo 65536) for an image of exact disparities, in raw units; both
  /// arrays have kKinectPixels elements. Windows wrap around at the image borders.
  void render(std::uint64_t frame, std::span<const float> exact, std::span<float> noise) const;

 private:
  /// How long a cell's drift keeps one random value, and the phase of frame 0.
  struct Epoch {
    float per_frame;
    float phase;
  };

  void fillCells(std::uint64_t frame, std::span<const float> exact, std::span<float> cells) const;

  NoisePatternParameters parameters_;
  std::uint32_t static_salt_;
  std::uint32_t slow_salt_;
  std::uint32_t drift_salt_;
  std::uint32_t fast_salt_;
  std::vector<float> fixed_;   // per cell: the part of the static component that depends only on the pixel
  std::vector<float> coarse_;  // per pixel; empty without distortion
  std::vector<Epoch> epochs_;  // per cell; empty without drift
};

}  // namespace hapticd::drivers
