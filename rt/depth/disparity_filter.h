// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>

#include "rt/base/parameters.h"
#include "rt/depth/depth_model.h"
#include "rt/depth/disparity_image.h"
#include "rt/depth/filter_kernel.h"

namespace hapticd::rt {

/// Converts frames of raw disparities to disparities with less noise, for a requested part of the image.
///
/// Temporal filter: each pixel is the mean over its last frames as long as new measurements stay near that
/// mean; a jump restarts the mean, so jumps add no lag. Slow motion shows as a non-zero mean of all
/// differences in a tile; the tile's means are then shortened to two frames. A pixel without a measurement
/// keeps its mean for some frames to prevent flicker. Spatial filter: the mean of those surrounding pixels
/// that belong to the same surface, so edges are preserved. Only requested tiles are tracked; a tile that was
/// not requested for the previous frame restarts.
///
/// Thread: one (the scene thread).  RT: allocates nothing after construction.
class DisparityFilter {
 public:
  /// Allocates all buffers. `model` outlives the filter.  RT: not safe.
  explicit DisparityFilter(const DepthModel& model);

  /// Returns the filtered disparities of the window, in frame layout, with kNoDisparity where nothing usable
  /// was measured. Pixels outside the window are undefined. Valid until the next call. The same frame may be
  /// filtered again with another window.
  const float* apply(const DisparityFrame& frame, const PixelWindow& window,
                     const FilterParameters& parameters) noexcept;

  /// Returns the images to the system until a filter is used, see rt::returnPages(). Before the first frame.
  /// RT: not safe.
  void returnUnused() noexcept;

  /// Restarts all means with the next frame.
  void forget() noexcept { std::fill_n(tiles_.get(), tile_count_, Tile{}); }

  /// Returns the result of the last apply() as raw values of the camera, in frame layout.
  const std::uint16_t* rounded(const PixelWindow& window) noexcept;

 private:
  static constexpr int kTileColumns = 64;
  static constexpr int kTileRows = 16;
  static_assert(kTileColumns == kRowAlignment_px);

  struct Tile {
    std::uint64_t frame = 0;        ///< frame up to which its means are current
    float mean_difference_raw = 0;  ///< average over the last frames
    float max_frames = 1;           ///< length of the means of its pixels
  };

  void clearOnce() noexcept;
  void convert(const DisparityFrame& frame, const PixelWindow& window) noexcept;
  void follow(const DisparityFrame& frame, const PixelWindow& window) noexcept;
  void follow(const DisparityFrame& frame, int tile_column, int tile_row) noexcept;
  void smooth(const PixelWindow& window) noexcept;

  PixelWindow grown(const PixelWindow& window, int margin) const noexcept;
  std::size_t pixelAt(int row, int column) const noexcept {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(stride_px_) +
           static_cast<std::size_t>(column);
  }

  const DepthModel& model_;
  int stride_px_;
  std::size_t pixels_;
  std::size_t margin_;       // pixels before the first and after the last one that the spatial mean may read
  Gate gate_;                // a measurement that differs from the mean by more belongs to another surface
  std::uint16_t raw_first_;  // first raw disparity that has a depth
  std::uint16_t raw_last_;   // last raw disparity that has a depth
  FilterParameters parameters_;
  int tiles_across_;
  std::size_t tile_count_;
  std::unique_ptr<Tile[]> tiles_;
  // Images of whole frames with a margin on all sides.
  std::unique_ptr<float[]> plain_;  // disparities of the newest frame
  std::unique_ptr<float[]> mean_;
  std::unique_ptr<float[]> frames_;
  std::unique_ptr<float[]> missing_;
  std::unique_ptr<float[]> smooth_;
  std::unique_ptr<std::uint16_t[]> rounded_;
  const float* newest_ = nullptr;
  bool cleared_ = false;  ///< pixels without a disparity hold kNoDisparity
};

}  // namespace hapticd::rt
