// SPDX-License-Identifier: Apache-2.0
#include "rt/modelling/surface/column_shifts.h"

#include <algorithm>
#include <cmath>

#include "rt/modelling/surface/column_shift_kernel.h"

namespace hapticd::rt {
namespace {

/// A larger difference means that the pixel shows another surface.
constexpr int kMaxDifference_raw = 3;
/// With fewer differences, a third of its pixels, the change of a tile is unknown.
constexpr int kMinDifferences = 128;
/// Allowed deviation of a tile's mean change from a whole number. Noise shared by neighbouring pixels has a
/// standard deviation of 0.08 raw units.
constexpr float kWhole_raw = 0.3F;
constexpr int kMinTilesInBand = 3;
constexpr int kMinTilesAtRest = 6;
constexpr int kMaxTilesAstray = 2;
/// An offset below this value counts as zero.
constexpr float kNone_raw = 0.01F;

}  // namespace

ColumnShifts::ColumnShifts(const DepthModel& model)
    : drifts_(model.rawIsDisparity() && model.parameters().principle == DepthPrinciple::structured_light),
      width_px_(model.width_px()),
      stride_px_(model.stride_px()),
      every_(model.height_px() / kRows),
      last_raw_(model.disparity().last_raw),
      tiles_(width_px_ / kTile_px),
      before_(std::make_unique<std::uint16_t[]>(kRows * static_cast<std::size_t>(stride_px_))),
      changes_before_{} {
  forget();
}

void ColumnShifts::forget() noexcept {
  offset_raw_.fill(0);
  changes_before_.fill(Change::unknown);
  sequence_ = 0;
  any_ = false;
}

void ColumnShifts::update(const DisparityFrame& frame) noexcept {
  if (!drifts_ || frame.sequence == sequence_) return;
  const bool follows = sequence_ != 0 && frame.sequence == sequence_ + 1;
  if (any_) fade(std::max(0.0, static_cast<double>(frame.arrival_ns - arrival_ns_) * 1e-9));
  compareAndKeep(frame);
  if (follows) {
    const Changes now = changes();
    const Bands bands = findBands(now);
    if (bands.left_raw != 0) shift(bands);
    changes_before_ = now;
  } else {
    changes_before_.fill(Change::unknown);
  }
  sequence_ = frame.sequence;
  arrival_ns_ = frame.arrival_ns;
}

void ColumnShifts::fade(double passed_s) noexcept {
  const auto kept = static_cast<float>(std::exp(-passed_s / kFade_s));
  any_ = false;
  for (float& offset : offset_raw_) {
    offset = std::abs(offset) < kNone_raw ? 0 : kept * offset;
    any_ = any_ || offset != 0;
  }
}

void ColumnShifts::compareAndKeep(const DisparityFrame& frame) noexcept {
  const RowComparison rows{.now = frame.raw + every_ / 2 * stride_px_,
                           .now_stride_px = static_cast<std::ptrdiff_t>(every_) * stride_px_,
                           .before = before_.get(),
                           .before_stride_px = stride_px_,
                           .rows = kRows,
                           .columns = stride_px_,
                           .last_raw = last_raw_,
                           .max_difference_raw = kMaxDifference_raw};
  sumUpDifferences(rows, sum_.data(), count_.data());
}

ColumnShifts::Changes ColumnShifts::changes() const noexcept {
  Changes result;
  for (std::size_t tile = 0; tile < static_cast<std::size_t>(tiles_); ++tile) {
    int sum = 0;
    int count = 0;
    for (std::size_t column = tile * kTile_px; column < (tile + 1) * kTile_px; ++column) {
      sum += sum_[column];
      count += count_[column];
    }
    result[tile] = Change::unknown;
    if (count < kMinDifferences) continue;
    const float mean = static_cast<float>(sum) / static_cast<float>(count);
    const float whole = std::round(mean);
    if (std::abs(whole) <= 1 && std::abs(mean - whole) <= kWhole_raw)
      result[tile] = static_cast<Change>(static_cast<int>(whole));
  }
  return result;
}

int ColumnShifts::tilesOfBand(const Changes& now, Side side, Change change) const noexcept {
  int tiles = 0;
  int end = 0;
  for (int i = 0; i < tiles_; ++i) {
    const std::size_t tile = tileAt(side, i);
    if (now[tile] == Change::unknown) continue;
    if (now[tile] != change || changes_before_[tile] != Change::rests) break;
    ++tiles;
    end = i + 1;
  }
  // The band must end sharply: at most one tile contains its end.
  const auto isAtRest = [&](int i) { return i < tiles_ && now[tileAt(side, i)] == Change::rests; };
  return tiles >= kMinTilesInBand && (isAtRest(end) || isAtRest(end + 1)) ? end : 0;
}

int ColumnShifts::columnsOfBand(Side side, int tiles, int raw) const noexcept {
  int columns = tiles * kTile_px;
  const auto steps = [&](int i) {
    const auto column = static_cast<std::size_t>(side == Side::left ? i : width_px_ - 1 - i);
    return 2 * raw * sum_[column] > count_[column];
  };
  while (columns < (tiles + 1) * kTile_px && steps(columns)) ++columns;
  return columns;
}

ColumnShifts::Bands ColumnShifts::findBands(const Changes& now) const noexcept {
  for (const int raw : {1, -1}) {
    const int left = tilesOfBand(now, Side::left, static_cast<Change>(raw));
    const int right = tilesOfBand(now, Side::right, static_cast<Change>(-raw));
    if (left == 0 || right == 0 || left + right >= tiles_) continue;
    // Between the bands, all tiles that can be compared must be at rest, apart from a few that show moving
    // objects.
    int resting = 0;
    int stepping = 0;
    for (auto tile = static_cast<std::size_t>(left); tile < static_cast<std::size_t>(tiles_ - right);
         ++tile) {
      const bool rested = changes_before_[tile] == Change::rests;
      if (now[tile] == Change::rests) ++resting;
      if (rested && (now[tile] == Change::rises || now[tile] == Change::falls)) ++stepping;
    }
    if (resting < kMinTilesAtRest || stepping > kMaxTilesAstray) continue;
    return {.left_columns = columnsOfBand(Side::left, left, raw),
            .right_columns = columnsOfBand(Side::right, right, -raw),
            .left_raw = raw};
  }
  return {};
}

void ColumnShifts::shift(const Bands& bands) noexcept {
  constexpr int kSide = BlockLattice::kBlock_px;
  any_ = true;
  for (int block = 0; block < width_px_ / kSide; ++block) {
    const int columns_left = std::clamp(bands.left_columns - block * kSide, 0, kSide);
    const int columns_right = std::clamp((block + 1) * kSide - (width_px_ - bands.right_columns), 0, kSide);
    offset_raw_[static_cast<std::size_t>(block)] +=
        static_cast<float>(bands.left_raw * (columns_left - columns_right)) / kSide;
  }
}

}  // namespace hapticd::rt
