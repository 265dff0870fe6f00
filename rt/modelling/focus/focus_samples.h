// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>

#include "rt/depth/depth_model.h"
#include "rt/modelling/focus/misfit.h"

namespace hapticd::rt {

/// Pixels around a focus in a square window, cell by cell. Each cell begins at a multiple of kAlignment and
/// is filled up with samples of weight 0.
struct FocusSamples {
  static constexpr int kCellsPerSide = FitSums::kCellsPerSide;
  static constexpr int kCells = FitSums::kCells;
  /// Largest number of samples in a row of the window.
  static constexpr int kMaxPerSide = 67;
  static constexpr std::size_t kAlignment = 16;
  static constexpr std::size_t kMax = kMaxPerSide * kMaxPerSide + kCells * kAlignment;

  alignas(64) float column_px[kMax];  ///< from the focus
  alignas(64) float row_px[kMax];
  alignas(64) float disparity_raw[kMax];
  alignas(64) float weight[kMax];  ///< 0 or 1
  std::size_t cell_begin[kCells + 1];
};

/// What a frame shows around a focus, and how it is sampled.
struct FocusImage {
  /// Half the sides of the windows that surfaces are fitted in.
  static constexpr double kRadius_m[] = {0.014, 0.022, 0.036, 0.06, 0.1};
  static constexpr std::size_t kWindows = std::size(kRadius_m);
  /// A smaller window does not determine a surface.
  static constexpr double kLeastRadius_px = 6;
  /// Fewer pixels do not either.
  static constexpr double kLeastPixels = 60;
  /// Side of the square of pixels that share one sample of the noise: the sensor's matching window.
  static constexpr double kPatch_px = 9;
  /// Pixels that differ by more standard deviations do not belong to a surface.
  static constexpr double kTolerance_sigma = 5;
  /// A window that agrees less with its surface than this has nothing to say about wider ones.
  static constexpr double kLeastShare = 0.05;
  /// Area of a surface of which nothing is known, square pixels: it may cover the whole window.
  static constexpr double kWholeWindow_px2 = 1e9;

  const std::uint16_t* image;  ///< raw disparities in frame layout, valid in `pixels`
  int stride_px;               ///< of a row
  PixelWindow pixels;
  const float* column_shift_raw;  ///< by columns of blocks: subtracted from the disparities
  double column_px;               ///< of the focus
  double row_px;
  double sigma_raw;      ///< standard deviation of a pixel
  double tolerance_raw;  ///< pixels that differ from a surface by more do not belong to it
  double beside_raw;     ///< those that differ by less than this belong to something that touches it
  double unit_m;         ///< depth of a raw unit
  double px_per_m;
  double moved_px;    ///< displacement of the focus since the frame before
  double max_frames;  ///< number of frames averaged, at least 1

  double radius_px(std::size_t window) const noexcept { return kRadius_m[window] * px_per_m; }
  /// Share of this frame in the means of misfits.
  double newShare() const noexcept { return std::min(1.0, 1 / max_frames + moved_px / kPatch_px); }

  /// Collects the pixels within `radius_px` of the focus, every `stride`-th in each direction. Returns their
  /// number.  RT: safe.
  std::size_t collect(double radius_px, int stride, FocusSamples& samples) const noexcept;
  /// Returns the distance between samples in a window, pixels, for about 550 on a surface that covers
  /// `area_px2` of it.  RT: safe.
  static int strideFor(double radius_px, double area_px2) noexcept;
};

}  // namespace hapticd::rt
