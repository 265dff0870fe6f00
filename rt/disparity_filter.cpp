// SPDX-License-Identifier: Apache-2.0
#include "rt/disparity_filter.h"

#include <algorithm>
#include <cmath>

#include "rt/scene.h"

namespace hapticd::rt {
namespace {

constexpr int kMaxRadius_px = 4;
/// Number of pixels before the first and after the last one that the spatial mean may read.
constexpr std::size_t kMargin = std::size_t{kMaxRadius_px} * kFrameWidth + kVectorPadding;

/// A measurement that differs from the mean by more belongs to another surface; sensor noise exceeds this in
/// 1 % of cases.
constexpr float kGate_raw = 2.5F;
/// A tile whose measurements differ from their means by more than this on average is moving. The noise of
/// that average, over 12 independent noise patches per tile and about 6 frames, is 0.07 raw units.
constexpr float kMotion_raw = 0.25F;
constexpr float kNewWeight = 0.3F;
constexpr float kFramesInMotion = 2;
constexpr float kMinPixels = 64;

constexpr std::size_t kPixelsWithMargin = kFramePixels + 2 * kMargin;

PixelWindow grown(const PixelWindow& window, int margin) noexcept {
  PixelWindow larger = window;
  larger.column_first = std::max(0, window.column_first - margin);
  larger.column_last = std::min(kFrameWidth - 1, window.column_last + margin);
  larger.row_first = std::max(0, window.row_first - margin);
  larger.row_last = std::min(kFrameHeight - 1, window.row_last + margin);
  return larger;
}

std::size_t pixelAt(int row, int column) noexcept {
  return static_cast<std::size_t>(row) * kFrameWidth + static_cast<std::size_t>(column);
}

}  // namespace

DisparityFilter::DisparityFilter(const DepthModel& model)
    : raw_first_(kRawNoMeasurement),
      raw_last_(0),
      plain_(std::make_unique<float[]>(kPixelsWithMargin)),
      mean_(std::make_unique<float[]>(kPixelsWithMargin)),
      frames_(std::make_unique<float[]>(kPixelsWithMargin)),
      missing_(std::make_unique<float[]>(kPixelsWithMargin)),
      smooth_(std::make_unique<float[]>(kPixelsWithMargin)),
      rounded_(std::make_unique<std::uint16_t[]>(kFramePixels + kVectorPadding)) {
  for (float* const image : {plain_.get(), mean_.get(), smooth_.get()}) {
    std::fill_n(image, kPixelsWithMargin, kNoDisparity);
  }
  for (std::uint16_t raw = 0; raw < kRawNoMeasurement; ++raw) {
    if (model.depth_m(raw) <= 0) continue;
    raw_first_ = std::min(raw_first_, raw);
    raw_last_ = raw;
  }
}

const float* DisparityFilter::apply(const DepthFrame& frame, const PixelWindow& window,
                                    const FilterParameters& parameters) noexcept {
  FilterParameters requested = parameters;
  requested.spatial_radius_px = std::clamp(requested.spatial_radius_px, 0, kMaxRadius_px);
  if (requested != parameters_) {
    parameters_ = requested;
    for (Tile& tile : tiles_) tile = {};
  }
  const int radius = parameters_.spatial_radius_px;
  const PixelWindow read = grown(window, radius);
  const bool in_time = parameters_.temporal_frames > 1 || parameters_.hold_frames > 0;
  if (in_time) {
    follow(frame, read);
  } else {
    convert(frame, read);
  }
  newest_ = (in_time ? mean_ : plain_).get() + kMargin;
  if (radius > 0) smooth(window);
  return newest_;
}

void DisparityFilter::convert(const DepthFrame& frame, const PixelWindow& window) noexcept {
  const int columns = window.column_last - window.column_first + 1;
  for (int row = window.row_first; row <= window.row_last; ++row) {
    const std::size_t first = pixelAt(row, window.column_first);
    // the last vector of the last row must not read beyond the frame
    const auto whole =
        static_cast<int>(std::min<std::size_t>(static_cast<std::size_t>(columns), kFramePixels - first));
    disparityOfRaw(frame.raw + first, whole, raw_first_, raw_last_, plain_.get() + kMargin + first);
  }
}

void DisparityFilter::follow(const DepthFrame& frame, const PixelWindow& window) noexcept {
  for (int tile_row = window.row_first / kTileRows; tile_row <= window.row_last / kTileRows; ++tile_row) {
    for (int tile = window.column_first / kTileColumns; tile <= window.column_last / kTileColumns; ++tile) {
      follow(frame, tile, tile_row);
    }
  }
}

void DisparityFilter::follow(const DepthFrame& frame, int tile_column, int tile_row) noexcept {
  Tile& tile = tiles_[static_cast<std::size_t>(tile_row * kTilesAcross + tile_column)];
  if (tile.frame == frame.sequence) return;
  const auto max_frames = static_cast<float>(std::max(1, parameters_.temporal_frames));
  constexpr std::uint64_t kFramesApart = 2;  // one frame may be lost
  const bool continues =
      tile.frame != 0 && tile.frame < frame.sequence && frame.sequence - tile.frame <= kFramesApart;
  if (!continues) tile = {.frame = 0, .mean_difference_raw = 0, .max_frames = max_frames};
  tile.frame = frame.sequence;

  const TemporalLimits limits{tile.max_frames, kGate_raw, static_cast<float>(parameters_.hold_frames)};
  Innovation innovation;
  for (int row = tile_row * kTileRows; row < (tile_row + 1) * kTileRows; ++row) {
    const std::size_t first = pixelAt(row, tile_column * kTileColumns);
    const std::size_t at = kMargin + first;
    alignas(kCacheLine) float disparity[kTileColumns];
    disparityOfRaw(frame.raw + first, kTileColumns, raw_first_, raw_last_, disparity);
    if (!continues) {
      std::fill_n(mean_.get() + at, kTileColumns, kNoDisparity);
      std::fill_n(missing_.get() + at, kTileColumns, 0.0F);
    }
    updateMeans(disparity, kTileColumns, limits, {mean_.get() + at, frames_.get() + at, missing_.get() + at},
                innovation);
  }
  if (innovation.pixels < kMinPixels) return;
  tile.mean_difference_raw +=
      kNewWeight * (innovation.sum_raw / innovation.pixels - tile.mean_difference_raw);
  const bool moving = std::abs(tile.mean_difference_raw) > kMotion_raw;
  tile.max_frames = std::min(max_frames, moving ? kFramesInMotion : tile.max_frames + 1);
}

void DisparityFilter::smooth(const PixelWindow& window) noexcept {
  const int columns = window.column_last - window.column_first + 1;
  for (int row = window.row_first; row <= window.row_last; ++row) {
    const std::size_t first = pixelAt(row, window.column_first);
    meanOfSimilar(newest_ + first, kFrameWidth, columns, parameters_.spatial_radius_px, kGate_raw,
                  smooth_.get() + kMargin + first);
  }
  newest_ = smooth_.get() + kMargin;
}

const std::uint16_t* DisparityFilter::rounded(const PixelWindow& window) noexcept {
  const int columns = window.column_last - window.column_first + 1;
  for (int row = window.row_first; row <= window.row_last; ++row) {
    const std::size_t first = pixelAt(row, window.column_first);
    rawOfDisparity(newest_ + first, columns, kRawNoMeasurement, rounded_.get() + first);
  }
  return rounded_.get();
}

}  // namespace hapticd::rt
