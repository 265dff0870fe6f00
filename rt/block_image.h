// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "rt/visible_surface.h"

namespace hapticd::rt {

/// Pixel work on a depth image, before surfaces are estimated: everything on 16-bit raw values, a vector of
/// pixels at a time.

/// What counts as a measurement, and which gaps between measurements are closed.
struct GapLimits {
  std::uint16_t raw_first;  ///< raw values that have a depth
  std::uint16_t raw_last;
  std::uint16_t remembered_first;  ///< raw values that are believed without a measurement
  std::uint16_t remembered_last;
  int longest_px;         ///< of a gap in a row
  float most_raw;         ///< that the two ends of a gap may differ by, ...
  float most_raw_per_px;  ///< ... plus this for each pixel of it: they are of one surface
};

/// Copies the pixels of `window` from `raw` to `image`, both in the layout of a frame. Gaps in a row are
/// closed by a straight line. What is left of the pixels without a depth becomes what `fallback` has there
/// (of the same layout; may be null), else kRawNoMeasurement, or SurfaceLayer::kBeyondView in gaps that reach
/// the image's left or right border and are no longer than `longest_px`.  RT: safe after the first call.
/// Cost: one pass over the pixels.
void copyClosingGaps(const std::uint16_t* raw, const std::uint16_t* fallback, const PixelWindow& window,
                     const GapLimits& limits, std::uint16_t* image) noexcept;

/// In `image`, which holds the visible surface, what `hidden` has behind it takes its place. True if that
/// changes anything.  RT: safe after the first call.
bool putHidden(const std::uint16_t* hidden, const PixelWindow& window, const GapLimits& limits,
               std::uint16_t* image) noexcept;

/// Of blocks side by side, written in whole vectors: sum and number of the measurements in each, and the
/// largest difference between neighbouring pixels; working memory of sumUpBlocks().
struct BlockRow {
  std::uint64_t sum[BlockLattice::kColumns + 8];
  std::uint64_t count[BlockLattice::kColumns + 8];
  std::uint64_t largest_step[BlockLattice::kColumns + 8];  ///< of no meaning unless all have a measurement
};

/// What the pixels of a block say.
struct BlockSums {
  float* disparity;  ///< mean of those that belong to the nearest surface in it; negative: there are too few
  std::uint8_t* is_full;  ///< all pixels have a measurement and belong to that surface
};

/// Fills `sums`, in the layout of BlockLattice, for `blocks`. `most_step`: larger differences between
/// neighbouring pixels, raw units, are between two surfaces.  RT: safe after the first call.
void sumUpBlocks(const std::uint16_t* image, const BlockWindow& blocks, int most_step,
                 const BlockSums& sums) noexcept;

}  // namespace hapticd::rt
