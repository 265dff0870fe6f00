// SPDX-License-Identifier: Apache-2.0
#include "rt/occlusion_memory.h"

#include <algorithm>
#include <bit>

namespace hapticd::rt {
namespace {

/// Beyond this depth raw values are too coarse; they are treated as places at this depth.
constexpr double kFarthest_m = 10;
/// Number of rows to prefetch ahead: memory latency exceeds the time for one row of a window.
constexpr std::size_t kRowsAhead = 2;

double depthOf(const DepthModelParameters& camera, int raw) {
  const double inverse_depth = camera.a_per_m * raw + camera.b_per_m;
  return inverse_depth > 1 / kFarthest_m ? 1 / inverse_depth : kFarthest_m;
}

bool isMeasured(std::uint16_t raw) noexcept {
  return raw < kRawNoMeasurement;
}

bool differsByNoise(std::uint16_t a, std::uint16_t b) noexcept {
  return std::max(a, b) - std::min(a, b) <= kRestNoise_raw;
}

}  // namespace

OcclusionMemory::OcclusionMemory(const DepthModel& model)
    : pixels_(std::make_unique<Pixels>()), falls_(model.parameters().a_per_m > 0), shell_end_{} {
  const auto depthOfNearness = [&](int nearness) {
    return depthOf(model.parameters(), nearnessOf(static_cast<std::uint16_t>(nearness)));
  };
  int end = 0;
  for (int nearness = 0; nearness < kRawNoMeasurement; ++nearness) {
    const double shell_from_m = depthOfNearness(nearness) - kShell_m;
    while (end < nearness && depthOfNearness(end) < shell_from_m) ++end;
    shell_end_[static_cast<std::size_t>(nearness)] =
        static_cast<std::uint16_t>(std::clamp(nearness - kMinShell_raw, 0, end));
  }
  forget();
}

void OcclusionMemory::forget() noexcept {
  ++epoch_;
  hidden_count_ = 0;
  newest_ = 0;
  newest_strip_ = kStripPeriod;
  samples_of_strip_ = {};
}

bool OcclusionMemory::hidesAnything(const PixelWindow& window) const noexcept {
  if (hidden_count_ == 0 || window.empty()) return false;
  const auto first = static_cast<std::size_t>(window.column_first) / kTile;
  const auto last = static_cast<std::size_t>(window.column_last) / kTile;
  for (auto row = static_cast<std::size_t>(window.row_first);
       row <= static_cast<std::size_t>(window.row_last); ++row) {
    if (epoch_of_row_[row] != epoch_) continue;
    const std::uint8_t* const tiles = &hidden_of_tile_[row * kTilesAcross];
    if (std::any_of(tiles + first, tiles + last + 1, [](std::uint8_t count) { return count > 0; }))
      return true;
  }
  return false;
}

void OcclusionMemory::update(const DepthFrame& frame, const PixelWindow& window) noexcept {
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
    newest_strip_ = frame.sequence % kStripPeriod;
    for (std::size_t row = newest_strip_ * kStripRows; row < (newest_strip_ + 1) * kStripRows; ++row) {
      updateRow(frame, row, 0, kFrameWidth - 1);
    }
  }
  if (window.empty()) return;
  for (auto row = static_cast<std::size_t>(window.row_first);
       row <= static_cast<std::size_t>(window.row_last); ++row) {
    if (row / kStripRows == newest_strip_) continue;  // already updated as part of the strip
    updateRow(frame, row, static_cast<std::size_t>(window.column_first),
              static_cast<std::size_t>(window.column_last));
  }
}

bool OcclusionMemory::cameraMoved(const DepthFrame& frame) noexcept {
  const std::size_t strip = frame.sequence % kStripPeriod;
  samples_of_strip_[strip] = {};
  for (std::size_t row = strip * kStripRows; row < (strip + 1) * kStripRows; ++row) {
    if (epoch_of_row_[row] == epoch_) compare(frame, row, samples_of_strip_[strip]);
  }
  Samples all;
  for (const Samples& of_strip : samples_of_strip_) {
    all.comparable += of_strip.comparable;
    all.moved += of_strip.moved;
  }
  return all.moved > kMovedShare * all.comparable;
}

void OcclusionMemory::compare(const DepthFrame& frame, std::size_t row, Samples& samples) noexcept {
  for (std::size_t tile = row * kTilesAcross; tile < (row + 1) * kTilesAcross; ++tile) {
    const std::uint16_t raw = frame.raw[tile * kTile];
    std::uint16_t& first = first_shown_[tile];
    if (!isMeasured(raw)) continue;
    if (first == kNothingSeen || isNearer(raw, first) || isNearer(first, raw)) {
      first = raw;  // another surface
      continue;
    }
    ++samples.comparable;
    if (!differsByNoise(raw, first)) ++samples.moved;
  }
}

bool OcclusionMemory::rowHides(std::size_t row) const noexcept {
  const std::uint8_t* const tiles = &hidden_of_tile_[row * kTilesAcross];
  return hidden_count_ > 0 &&
         std::any_of(tiles, tiles + kTilesAcross, [](std::uint8_t count) { return count > 0; });
}

void OcclusionMemory::startRow(std::size_t row) noexcept {
  epoch_of_row_[row] = epoch_;
  std::fill_n(pixels_->visible + row * kFrameWidth, kFrameWidth, kNothingSeen);
  std::fill_n(pixels_->hidden + row * kFrameWidth, kFrameWidth, kRawNoMeasurement);
  std::fill_n(&first_shown_[row * kTilesAcross], kTilesAcross, kNothingSeen);
  std::fill_n(&hidden_of_tile_[row * kTilesAcross], kTilesAcross, std::uint8_t{0});
}

void OcclusionMemory::updateRow(const DepthFrame& frame, std::size_t row, std::size_t column_first,
                                std::size_t column_last) noexcept {
  if (epoch_of_row_[row] != epoch_) startRow(row);
  const std::size_t first = row * kFrameWidth;
  const OcclusionRow pixels{.raw = frame.raw + first,
                            .visible = pixels_->visible + first,
                            .hidden = pixels_->hidden + first,
                            .since = pixels_->since + first,
                            .hidden_of_tile = &hidden_of_tile_[row * kTilesAcross],
                            .hides = rowHides(row),
                            .block_first = column_first / kOcclusionBlock,
                            .block_last = column_last / kOcclusionBlock,
                            .ahead = row + kRowsAhead < kFrameHeight ? kRowsAhead * kFrameWidth : 0,
                            .shell_end = shell_end_.data(),
                            .falls = falls_,
                            .now = now_,
                            .hold_frames = kHoldFrames,
                            .settled_frames = kSettledFrames};
  const OcclusionLeft left = updatePixels(pixels);
  hidden_count_ += static_cast<std::uint32_t>(left.more_hidden);  // a negative change wraps around, and back
  Gap gap;
  for (std::uint32_t blocks = left.overdue_blocks; blocks != 0; blocks &= blocks - 1) {
    dropOverdue(pixels, static_cast<std::size_t>(std::countr_zero(blocks)) * kOcclusionBlock, gap);
  }
}

void OcclusionMemory::dropOverdue(const OcclusionRow& row, std::size_t column_first, Gap& gap) noexcept {
  for (std::size_t column = column_first; column < column_first + kOcclusionBlock; ++column) {
    std::uint16_t& hidden = row.hidden[column];
    if (isMeasured(row.raw[column]) || row.visible[column] == kNothingSeen) continue;
    if (static_cast<std::uint16_t>(now_ - row.since[column]) < kHoldFrames) continue;
    if (inShadow(row.raw, column, hidden, gap)) {
      row.since[column] = now_;
      continue;
    }
    row.visible[column] = kNothingSeen;
    if (hidden == kRawNoMeasurement) continue;
    hidden = kRawNoMeasurement;
    --row.hidden_of_tile[column / kTile];
    --hidden_count_;
  }
}

bool OcclusionMemory::inShadow(const std::uint16_t* raw_row, std::size_t column, std::uint16_t raw,
                               Gap& gap) const noexcept {
  if (column < gap.begin || column >= gap.end) {
    gap.begin = column;
    while (gap.begin > 0 && !isMeasured(raw_row[gap.begin - 1])) --gap.begin;
    gap.end = column + 1;
    while (gap.end < kFrameWidth && !isMeasured(raw_row[gap.end])) ++gap.end;
    gap.nearest_beside = kNothingSeen;
    if (gap.begin > 0) gap.nearest_beside = nearnessOf(raw_row[gap.begin - 1]);
    if (gap.end < kFrameWidth)
      gap.nearest_beside = std::min(gap.nearest_beside, nearnessOf(raw_row[gap.end]));
  }
  return raw != kRawNoMeasurement && gap.nearest_beside < shell_end_[nearnessOf(raw)];
}

}  // namespace hapticd::rt
