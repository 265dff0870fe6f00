// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "rt/depth_frame.h"
#include "rt/visible_surface.h"

namespace hapticd::rt {

/// What the sensor itself adds to the disparity of bands of columns.
///
/// A Kinect v1 that warms up adapts its disparities to its temperature: from one frame to the next the
/// columns at the left border rise by one raw unit and those at the right border fall by one, or the other
/// way round, whatever they look at; in between nothing changes (measured on recordings). At 2.7 m a raw unit
/// is 20 mm, which is more than a hand presses, so a contact there would be lost or doubled at once.
///
/// Such a step is distinguished from motion by what motion does not do: both sides step from rest by one raw
/// unit, in opposite directions, within one frame, with a sharp end of each band, while columns in between
/// rest. It then goes into the offsets, and from there it fades with the time constant kFade_s, because the
/// sensor's own adaptation is taken to be right in the end.
///
/// Thread: one (the scene thread).  RT: allocates nothing after construction; see() reads 24 rows.
class ColumnShifts {
 public:
  static constexpr double kFade_s = 20;

  ColumnShifts();

  /// Takes in a new frame.
  void see(const DepthFrame& frame) noexcept;

  /// What to take away from the disparities of a column of blocks, raw units.
  float offsetOf(int block_column) const noexcept {
    return offset_raw_[static_cast<std::size_t>(block_column)];
  }

  /// Nothing is shifted, and the next frame is the first one.
  void forget() noexcept;

 private:
  /// The rows that are compared: kRows, one in kEvery.
  static constexpr int kRows = 24;
  static constexpr int kEvery = kFrameHeight / kRows;
  static_assert(kRows * kEvery == kFrameHeight);
  static constexpr int kTile_px = 16;
  static constexpr int kTiles = kFrameWidth / kTile_px;
  static_assert(kTiles * kTile_px == kFrameWidth && kTile_px % BlockLattice::kBlock_px == 0);

  /// How the disparities of the columns in a tile changed since the frame before.
  enum class Change : std::int8_t { falls = -1, rests = 0, rises = 1, unknown = 2 };
  using Changes = std::array<Change, kTiles>;
  enum class Side : std::uint8_t { left, right };
  struct Bands {
    int left_columns = 0;   ///< how many, from the left border on
    int right_columns = 0;  ///< likewise from the right border
    int left_raw = 0;       ///< change of the left ones, the right ones change by its opposite; 0: no bands
  };

  /// The i-th tile from a border of the image on.
  static std::size_t tileAt(Side side, int i) noexcept {
    return static_cast<std::size_t>(side == Side::left ? i : kTiles - 1 - i);
  }
  /// The i-th of the rows that are compared.
  static const std::uint16_t* rowOf(const DepthFrame& frame, int i) noexcept {
    return frame.raw + (i * kEvery + kEvery / 2) * kFrameWidth;
  }
  void compare(const DepthFrame& frame) noexcept;
  void keep(const DepthFrame& frame) noexcept;
  Changes changes() const noexcept;
  Bands findBands(const Changes& now) const noexcept;
  void fade(double passed_s) noexcept;
  /// From a border of the image on, all that can be compared changes alike after a frame at rest: up to that
  /// tile. 0: it does not.
  int tilesOfBand(const Changes& now, Side side, Change change) const noexcept;
  int columnsOfBand(Side side, int tiles, int raw) const noexcept;
  void shift(const Bands& bands) noexcept;

  std::unique_ptr<std::uint16_t[]> before_;  ///< the rows that are compared, of the frame before
  std::array<std::int16_t, kFrameWidth> sum_{};
  std::array<std::int16_t, kFrameWidth> count_{};
  std::array<float, BlockLattice::kColumns> offset_raw_{};
  Changes changes_before_{};
  std::uint64_t sequence_ = 0;  ///< of the frame before; 0: none
  std::int64_t arrival_ns_ = 0;
  bool any_ = false;  ///< an offset is not zero
};

}  // namespace hapticd::rt
