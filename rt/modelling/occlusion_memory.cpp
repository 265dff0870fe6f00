// SPDX-License-Identifier: Apache-2.0
#include "rt/modelling/occlusion_memory.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace hapticd::rt {
namespace {

/// Beyond this depth raw values are too coarse; they are treated as places at this depth.
constexpr double kFarthest_m = 10;

double depthOf(const DepthModel& model, int raw) {
  const double inverse_depth = model.disparity().inverseDepth_per_m(raw);
  return inverse_depth > 1 / kFarthest_m ? 1 / inverse_depth : kFarthest_m;
}

/// Tolerances for the noise of a Kinect v1, multiplied by DepthModel::noiseScale(); see OcclusionPixels. Far
/// away, where the shell would be thinner than kMinShell_raw, noise must not look like an occluder.
constexpr double kRestNoise_raw = 2;
constexpr double kMinShell_raw = 3;

/// Returns a tolerance for a noise scale in whole raw units.
std::uint16_t scaled(double tolerance_raw, double noise_scale) {
  return static_cast<std::uint16_t>(std::min<double>(kMaxTolerance, std::ceil(noise_scale * tolerance_raw)));
}

/// Returns a tolerance for the noise of a camera at each disparity. Where the noise rises with the disparity,
/// which no camera's does, it is that at the greatest disparity.
FallingTolerance scaled(double tolerance_raw, const DepthModel& model) {
  const DisparityTolerance& noise = model.noiseBound();
  const double last = model.disparity().last_raw;
  const double least = std::max(0.0, noise.at(last));
  const std::uint16_t at_zero = scaled(tolerance_raw, std::max(noise.at_zero, least));
  const double fall = (at_zero - scaled(tolerance_raw, least)) / last;
  return {.at_zero = at_zero, .fall = static_cast<std::uint16_t>(std::floor(fall * 0x1p16))};
}

}  // namespace

OcclusionMemory::OcclusionMemory(const DepthModel& model)
    : rows_(static_cast<std::size_t>(model.height_px())),
      stride_px_(static_cast<std::size_t>(model.stride_px())),
      tiles_across_(stride_px_ / kTile),
      strip_rows_(std::min(rows_, kStripPixels / stride_px_)),
      falls_(model.disparity().a_per_m > 0),
      last_raw_(model.disparity().last_raw),
      rest_noise_(scaled(kRestNoise_raw, model)),
      min_shell_(scaled(kMinShell_raw, model)),
      visible_(hwy::AllocateAligned<std::uint16_t>(model.pixels())),
      hidden_(hwy::AllocateAligned<std::uint16_t>(model.pixels() + kVectorPadding)),
      since_(hwy::AllocateAligned<std::uint16_t>(model.pixels())),
      shell_end_(std::make_unique<std::uint16_t[]>(last_raw_ + std::size_t{1})),
      strips_((rows_ + strip_rows_ - 1) / strip_rows_),
      hidden_of_tile_(std::make_unique<std::uint8_t[]>(rows_ * tiles_across_)),
      samples_of_strip_(std::make_unique<Samples[]>(strips_)),
      first_shown_(std::make_unique<std::uint16_t[]>(rows_ * tiles_across_)),
      epoch_of_row_(std::make_unique<std::uint32_t[]>(rows_)) {
  const auto depthOfNearness = [&](int nearness) {
    return depthOf(model, nearnessOf(static_cast<std::uint16_t>(nearness)));
  };
  std::fill_n(visible_.get(), model.pixels(), kNothingSeen);
  std::fill_n(hidden_.get(), model.pixels() + kVectorPadding, kNoRawDisparity);
  std::fill_n(since_.get(), model.pixels(), std::uint16_t{0});
  int end = 0;
  for (int nearness = 0; nearness <= last_raw_; ++nearness) {
    const double shell_from_m = depthOfNearness(nearness) - kShell_m;
    while (end < nearness && depthOfNearness(end) < shell_from_m) ++end;
    const int least = scaled(kMinShell_raw, model.noiseScale(depthOfNearness(nearness)));
    shell_end_[static_cast<std::size_t>(nearness)] =
        static_cast<std::uint16_t>(std::clamp(nearness - least, 0, end));
  }
  forget();
}

void OcclusionMemory::forget() noexcept {
  ++epoch_;
  hidden_count_ = 0;
  newest_ = 0;
  newest_strip_ = {};
  std::fill_n(samples_of_strip_.get(), strips_, Samples{});
}

bool OcclusionMemory::hidesAnything(const PixelWindow& window) const noexcept {
  if (hidden_count_ == 0 || window.empty()) return false;
  const auto first = static_cast<std::size_t>(window.column_first) / kTile;
  const auto last = static_cast<std::size_t>(window.column_last) / kTile;
  for (auto row = static_cast<std::size_t>(window.row_first);
       row <= static_cast<std::size_t>(window.row_last); ++row) {
    if (epoch_of_row_[row] != epoch_) continue;
    const std::uint8_t* const tiles = &hidden_of_tile_[row * tiles_across_];
    if (std::any_of(tiles + first, tiles + last + 1, [](std::uint8_t count) { return count > 0; }))
      return true;
  }
  return false;
}

void OcclusionMemory::update(const DisparityFrame& frame, const PixelWindow& window) noexcept {
  if (frame.sequence != newest_) {
    constexpr auto kMaxGap_ns = static_cast<std::int64_t>(kMaxGap_s * 1e9);
    const bool continues =
        newest_ != 0 && frame.sequence > newest_ && frame.arrival_ns - newest_ns_ <= kMaxGap_ns;
    if (!continues) forget();
    newest_ = frame.sequence;
    newest_ns_ = frame.arrival_ns;
    now_ = static_cast<std::uint16_t>(frame.sequence);
    if (cameraMoved(frame)) {
      forget();
      newest_ = frame.sequence;
    }
    newest_strip_ = stripOf(frame.sequence);
    updateRows(frame, newest_strip_);
  }
  if (window.empty()) return;
  // The rows of the strip are updated already.
  PixelWindow above = window;
  above.row_last = std::min(window.row_last, newest_strip_.row_first - 1);
  updateRows(frame, above);
  PixelWindow below = window;
  below.row_first = std::max(window.row_first, newest_strip_.row_last + 1);
  updateRows(frame, below);
}

PixelWindow OcclusionMemory::stripOf(std::uint64_t sequence) const noexcept {
  const std::size_t first = sequence % strips_ * strip_rows_;
  const std::size_t end = std::min(rows_, first + strip_rows_);
  return {.column_last = static_cast<int>(stride_px_) - 1,
          .row_first = static_cast<int>(first),
          .row_last = static_cast<int>(end) - 1};
}

bool OcclusionMemory::cameraMoved(const DisparityFrame& frame) noexcept {
  Samples& samples = samples_of_strip_[frame.sequence % strips_];
  samples = {};
  const PixelWindow strip = stripOf(frame.sequence);
  for (auto row = static_cast<std::size_t>(strip.row_first); row <= static_cast<std::size_t>(strip.row_last);
       ++row) {
    if (epoch_of_row_[row] == epoch_) compare(frame, row, samples);
  }
  Samples all;
  for (std::size_t i = 0; i < strips_; ++i) {
    const Samples& of_strip = samples_of_strip_[i];
    all.comparable += of_strip.comparable;
    all.moved += of_strip.moved;
  }
  return all.moved > kMovedShare * all.comparable;
}

void OcclusionMemory::compare(const DisparityFrame& frame, std::size_t row, Samples& samples) noexcept {
  for (std::size_t tile = row * tiles_across_; tile < (row + 1) * tiles_across_; ++tile) {
    const std::uint16_t raw = frame.raw[tile * kTile];
    std::uint16_t& first = first_shown_[tile];
    if (!isMeasured(raw)) continue;
    if (first == kNothingSeen || isNearer(raw, first) || isNearer(first, raw)) {
      first = raw;  // another surface
      continue;
    }
    ++samples.comparable;
    if (std::max(raw, first) - std::min(raw, first) > rest_noise_.at(raw)) ++samples.moved;
  }
}

void OcclusionMemory::startRow(std::size_t row) noexcept {
  epoch_of_row_[row] = epoch_;
  std::fill_n(visible_.get() + row * stride_px_, stride_px_, kNothingSeen);
  std::fill_n(hidden_.get() + row * stride_px_, stride_px_, kNoRawDisparity);
  std::fill_n(&first_shown_[row * tiles_across_], tiles_across_, kNothingSeen);
  std::fill_n(&hidden_of_tile_[row * tiles_across_], tiles_across_, std::uint8_t{0});
}

void OcclusionMemory::updateRows(const DisparityFrame& frame, const PixelWindow& window) noexcept {
  if (window.row_first > window.row_last) return;
  const OcclusionWindow rows{.row_first = static_cast<std::size_t>(window.row_first),
                             .row_last = static_cast<std::size_t>(window.row_last),
                             .block_first = static_cast<std::size_t>(window.column_first) / kOcclusionBlock,
                             .block_last = static_cast<std::size_t>(window.column_last) / kOcclusionBlock};
  for (std::size_t row = rows.row_first; row <= rows.row_last; ++row) {
    if (epoch_of_row_[row] != epoch_) startRow(row);
  }
  const OcclusionPixels pixels{.rows = rows_,
                               .stride_px = stride_px_,
                               .visible = visible_.get(),
                               .hidden = hidden_.get(),
                               .since = since_.get(),
                               .hidden_of_tile = hidden_of_tile_.get(),
                               .rest_noise = rest_noise_,
                               .min_shell = min_shell_,
                               .shell_end = shell_end_.get(),
                               .last_raw = last_raw_,
                               .falls = falls_,
                               .hold_frames = kHoldFrames,
                               .settled_frames = kSettledFrames};
  // A negative change wraps around, and back.
  hidden_count_ += static_cast<std::uint32_t>(updatePixels(pixels, rows, frame.raw, now_));
}

}  // namespace hapticd::rt
