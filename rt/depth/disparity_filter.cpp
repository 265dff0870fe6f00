// SPDX-License-Identifier: Apache-2.0
#include "rt/depth/disparity_filter.h"

#include <algorithm>
#include <cmath>

#include "rt/base/realtime_thread.h"

namespace hapticd::rt {
namespace {

constexpr int kMaxRadius_px = 4;

// Tolerances for the noise of a Kinect v1, multiplied by DepthModel::noiseScale().

/// Noise exceeds this in 1 % of cases.
constexpr float kGate_raw = 2.5F;
/// A tile whose measurements differ from their means by more than this on average is moving. The noise of a
/// tile's average, over 12 independent noise patches per tile and about 6 frames, is 0.07 raw units.
constexpr float kMotion_raw = 0.25F;
constexpr float kNewWeight = 0.3F;
constexpr float kFramesInMotion = 2;
constexpr float kMinPixels = 64;

/// Returns a tolerance for the noise of a camera at each disparity.
Gate scaled(float tolerance_raw, const DepthModel& model) {
  const DisparityTolerance& noise = model.noiseBound();
  return {.at_zero = static_cast<float>(double{tolerance_raw} * noise.at_zero),
          .per_raw = static_cast<float>(double{tolerance_raw} * noise.per_raw)};
}

/// Converts disparities to raw values of a camera with another depth law.
void rawOfCamera(const DepthModel& model, const float* disparity, int count, std::uint16_t* raw) noexcept {
  for (int i = 0; i < count; ++i) {
    raw[i] = disparity[i] < 0 ? model.parameters().raw_no_measurement : model.rawOfDisparity(disparity[i]);
  }
}

}  // namespace

DisparityFilter::DisparityFilter(const DepthModel& model)
    : model_(model),
      stride_px_(model.stride_px()),
      pixels_(model.pixels()),
      margin_(static_cast<std::size_t>(kMaxRadius_px * stride_px_) + kVectorPadding),
      gate_(scaled(kGate_raw, model)),
      raw_first_(model.rawIsDisparity() ? model.firstRaw() : model.wholeDisparity().raw_first),
      raw_last_(model.rawIsDisparity() ? model.lastRaw() : model.wholeDisparity().raw_last),
      tiles_across_(stride_px_ / kTileColumns),
      tile_count_(
          static_cast<std::size_t>(tiles_across_ * ((model.height_px() + kTileRows - 1) / kTileRows))),
      tiles_(std::make_unique<Tile[]>(tile_count_)),
      plain_(std::make_unique<float[]>(pixels_ + 2 * margin_)),
      mean_(std::make_unique<float[]>(pixels_ + 2 * margin_)),
      frames_(std::make_unique<float[]>(pixels_ + 2 * margin_)),
      missing_(std::make_unique<float[]>(pixels_ + 2 * margin_)),
      smooth_(std::make_unique<float[]>(pixels_ + 2 * margin_)),
      rounded_(std::make_unique<std::uint16_t[]>(pixels_ + kVectorPadding)) {}

void DisparityFilter::returnUnused() noexcept {
  for (float* const image : {plain_.get(), mean_.get(), frames_.get(), missing_.get(), smooth_.get()}) {
    returnPages(image, (pixels_ + 2 * margin_) * sizeof(float));
  }
  returnPages(rounded_.get(), (pixels_ + kVectorPadding) * sizeof(std::uint16_t));
}

/// Not in the constructor, so that boxes that filter nothing need no memory for it.
void DisparityFilter::clearOnce() noexcept {
  if (cleared_) return;
  cleared_ = true;
  for (float* const image : {plain_.get(), mean_.get(), smooth_.get()}) {
    std::fill_n(image, pixels_ + 2 * margin_, kNoDisparity);
  }
}

PixelWindow DisparityFilter::grown(const PixelWindow& window, int margin) const noexcept {
  PixelWindow larger = window;
  larger.column_first = std::max(0, window.column_first - margin);
  larger.column_last = std::min(model_.width_px() - 1, window.column_last + margin);
  larger.row_first = std::max(0, window.row_first - margin);
  larger.row_last = std::min(model_.height_px() - 1, window.row_last + margin);
  return larger;
}

const float* DisparityFilter::apply(const DisparityFrame& frame, const PixelWindow& window,
                                    const FilterParameters& parameters) noexcept {
  clearOnce();
  FilterParameters requested = parameters;
  requested.spatial_radius_px = std::clamp(requested.spatial_radius_px, 0, kMaxRadius_px);
  if (requested != parameters_) {
    parameters_ = requested;
    forget();
  }
  const int radius = parameters_.spatial_radius_px;
  const PixelWindow read = grown(window, radius);
  const bool in_time = parameters_.temporal_frames > 1 || parameters_.hold_frames > 0;
  if (in_time) {
    follow(frame, read);
  } else {
    convert(frame, read);
  }
  newest_ = (in_time ? mean_ : plain_).get() + margin_;
  if (radius > 0) smooth(window);
  return newest_;
}

void DisparityFilter::convert(const DisparityFrame& frame, const PixelWindow& window) noexcept {
  const int columns = window.column_last - window.column_first + 1;
  for (int row = window.row_first; row <= window.row_last; ++row) {
    const std::size_t first = pixelAt(row, window.column_first);
    // the last vector of the last row must not read beyond the frame
    const auto whole =
        static_cast<int>(std::min<std::size_t>(static_cast<std::size_t>(columns), pixels_ - first));
    disparityOfRaw(frame.raw + first, whole, raw_first_, raw_last_, plain_.get() + margin_ + first);
  }
}

void DisparityFilter::follow(const DisparityFrame& frame, const PixelWindow& window) noexcept {
  for (int tile_row = window.row_first / kTileRows; tile_row <= window.row_last / kTileRows; ++tile_row) {
    for (int tile = window.column_first / kTileColumns; tile <= window.column_last / kTileColumns; ++tile) {
      follow(frame, tile, tile_row);
    }
  }
}

void DisparityFilter::follow(const DisparityFrame& frame, int tile_column, int tile_row) noexcept {
  Tile& tile = tiles_[static_cast<std::size_t>(tile_row * tiles_across_ + tile_column)];
  if (tile.frame == frame.sequence) return;
  const auto max_frames = static_cast<float>(std::max(1, parameters_.temporal_frames));
  constexpr std::uint64_t kFramesApart = 2;  // one frame may be lost
  const bool continues =
      tile.frame != 0 && tile.frame < frame.sequence && frame.sequence - tile.frame <= kFramesApart;
  if (!continues) tile = {.frame = 0, .mean_difference_raw = 0, .max_frames = max_frames};
  tile.frame = frame.sequence;

  const TemporalLimits limits{tile.max_frames, gate_, static_cast<float>(parameters_.hold_frames)};
  Innovation innovation;
  const int end = std::min(model_.height_px(), (tile_row + 1) * kTileRows);
  for (int row = tile_row * kTileRows; row < end; ++row) {
    const std::size_t first = pixelAt(row, tile_column * kTileColumns);
    const std::size_t at = margin_ + first;
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
  const float motion_raw = kMotion_raw / kGate_raw * (innovation.sum_of_gates / innovation.pixels);
  const bool moving = std::abs(tile.mean_difference_raw) > motion_raw;
  tile.max_frames = std::min(max_frames, moving ? kFramesInMotion : tile.max_frames + 1);
}

void DisparityFilter::smooth(const PixelWindow& window) noexcept {
  const int columns = window.column_last - window.column_first + 1;
  for (int row = window.row_first; row <= window.row_last; ++row) {
    const std::size_t first = pixelAt(row, window.column_first);
    meanOfSimilar(newest_ + first, stride_px_, columns, parameters_.spatial_radius_px, gate_,
                  smooth_.get() + margin_ + first);
  }
  newest_ = smooth_.get() + margin_;
}

const std::uint16_t* DisparityFilter::rounded(const PixelWindow& window) noexcept {
  const int columns = window.column_last - window.column_first + 1;
  for (int row = window.row_first; row <= window.row_last; ++row) {
    const std::size_t first = pixelAt(row, window.column_first);
    if (model_.rawIsDisparity()) {
      rawOfDisparity(newest_ + first, columns, model_.parameters().raw_no_measurement,
                     rounded_.get() + first);
    } else {
      rawOfCamera(model_, newest_ + first, columns, rounded_.get() + first);
    }
  }
  return rounded_.get();
}

}  // namespace hapticd::rt
