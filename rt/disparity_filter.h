// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "rt/depth_frame.h"
#include "rt/depth_model.h"
#include "rt/filter_kernel.h"
#include "rt/parameters.h"

namespace hapticd::rt {

/// Raw frames to disparities with less noise, for the part of the image that is asked for.
///
/// In time: a pixel is the mean over its last frames as long as each measurement stays near it; a jump starts
/// it anew, so it adds no lag there. Slow motion shows as a mean of all differences in a tile that is not
/// zero; then the tile's means are cut to two frames. A pixel without measurement keeps its mean for some
/// frames, against flicker. In space: the mean of those pixels around that belong to the same surface, so
/// edges stay. Only tiles that are asked for are followed; one that was not asked for at the frame before
/// starts anew. Thread: one (the scene thread).  RT: allocates nothing after construction.
class DisparityFilter {
 public:
  explicit DisparityFilter(const DepthModel& model);

  /// Disparities of the window, in the layout of a whole frame; kNoDisparity where nothing usable was
  /// measured. Pixels outside the window are undefined. Valid until the next call. The same frame may be
  /// asked for again with another window.
  const float* apply(const DepthFrame& frame, const PixelWindow& window,
                     const FilterParameters& parameters) noexcept;

  /// The next frame starts all means anew.
  void forget() noexcept { tiles_ = {}; }

  /// The same, rounded to raw values, in the layout of a frame: for what reads integers.
  const std::uint16_t* rounded(const PixelWindow& window) noexcept;

 private:
  static constexpr int kTileColumns = 64;
  static constexpr int kTileRows = 16;
  static constexpr int kTilesAcross = kFrameWidth / kTileColumns;
  static constexpr int kTilesDown = kFrameHeight / kTileRows;
  static_assert(kTilesAcross * kTileColumns == kFrameWidth && kTilesDown * kTileRows == kFrameHeight);

  struct Tile {
    std::uint64_t frame = 0;        ///< that its means are up to date with
    float mean_difference_raw = 0;  ///< over the last frames
    float most_frames = 1;          ///< that its pixels are a mean over
  };

  void convert(const DepthFrame& frame, const PixelWindow& window) noexcept;
  void follow(const DepthFrame& frame, const PixelWindow& window) noexcept;
  void follow(const DepthFrame& frame, int tile_column, int tile_row) noexcept;
  void smooth(const PixelWindow& window) noexcept;

  std::uint16_t raw_first_;  // that have a depth
  std::uint16_t raw_last_;
  FilterParameters parameters_;
  std::array<Tile, static_cast<std::size_t>(kTilesAcross) * kTilesDown> tiles_{};
  std::unique_ptr<float[]> plain_;  // of the frame; with a margin on all sides, as the next
  std::unique_ptr<float[]> mean_;
  std::unique_ptr<float[]> frames_;
  std::unique_ptr<float[]> missing_;
  std::unique_ptr<float[]> smooth_;
  std::unique_ptr<std::uint16_t[]> rounded_;
  const float* newest_ = nullptr;
};

}  // namespace hapticd::rt
