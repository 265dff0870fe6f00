// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "rt/depth/disparity_image.h"
#include "rt/scene/visible_surface.h"

namespace hapticd::rt {

/// Estimates the disparity offsets that the sensor itself adds to bands of columns.
///
/// A Kinect v1 that warms up adapts its disparities to its temperature: from one frame to the next, the
/// columns at the left border rise by one raw unit and those at the right border fall by one, or vice versa,
/// whatever they show; the columns in between do not change (measured on recordings). At 2.7 m a raw unit is
/// 20 mm, more than a hand typically presses in, so a contact would be lost or doubled at once.
///
/// Such a step is told apart from motion by its shape: both sides step from rest by one raw unit, in opposite
/// directions, within one frame, each band ends sharply, and the columns in between are at rest. The step is
/// added to the offsets, which then decay with the time constant kFade_s, because the sensor's adaptation is
/// assumed to be correct in the long run.
///
/// Thread: one (the scene thread).  RT: allocates nothing after construction; update() reads 24 rows.
class ColumnShifts {
 public:
  static constexpr double kFade_s = 20;

  /// Only structured light drifts like this; for other cameras all offsets remain 0.
  explicit ColumnShifts(const DepthModel& model);

  /// Compares a new frame with the previous one and updates the offsets.
  void update(const DisparityFrame& frame) noexcept;

  /// Returns the offset to subtract from the disparities of each column of blocks, in raw units, with
  /// kVectorPadding spare elements.
  const float* offsets() const noexcept { return offset_raw_.data(); }

  /// Clears all offsets; the next frame is treated as the first one.
  void forget() noexcept;

 private:
  /// kRows rows, evenly spread over the image, are compared.
  static constexpr int kRows = 24;
  static constexpr int kTile_px = 16;
  static constexpr int kMaxTiles = kMaxFrameWidth / kTile_px;
  static_assert(kTile_px % BlockLattice::kBlock_px == 0);

  /// Change of the disparities of a tile of columns since the previous frame.
  enum class Change : std::int8_t { falls = -1, rests = 0, rises = 1, unknown = 2 };
  using Changes = std::array<Change, kMaxTiles>;
  enum class Side : std::uint8_t { left, right };
  /// The two bands of columns at the image borders that stepped in one frame.
  struct Bands {
    int left_columns = 0;   ///< width of the band at the left border
    int right_columns = 0;  ///< width of the band at the right border
    int left_raw = 0;       ///< change of the left band; the right one changes by the opposite; 0: no bands
  };

  /// Returns the index of the i-th tile counted from a border of the image.
  std::size_t tileAt(Side side, int i) const noexcept {
    return static_cast<std::size_t>(side == Side::left ? i : tiles_ - 1 - i);
  }
  void compareAndKeep(const DisparityFrame& frame) noexcept;
  Changes changes() const noexcept;
  Bands findBands(const Changes& now) const noexcept;
  void fade(double passed_s) noexcept;
  /// Returns the number of tiles, counted from a border, that all made the same change after a frame at rest;
  /// 0 if there is no such band.
  int tilesOfBand(const Changes& now, Side side, Change change) const noexcept;
  /// Returns the width of a band in columns. `tiles`: its whole tiles; `raw`: its change.
  int columnsOfBand(Side side, int tiles, int raw) const noexcept;
  void shift(const Bands& bands) noexcept;

  bool drifts_;  ///< the camera drifts like this
  int width_px_;
  int stride_px_;
  int every_;               ///< distance between compared rows
  std::uint16_t last_raw_;  ///< see DisparityScale
  int tiles_;
  std::unique_ptr<std::uint16_t[]> before_;  ///< the compared rows of the previous frame
  std::array<std::int16_t, kMaxFrameWidth> sum_{};
  std::array<std::int16_t, kMaxFrameWidth> count_{};
  std::array<float, BlockLattice::kMaxColumns + kVectorPadding> offset_raw_{};
  Changes changes_before_{};
  std::uint64_t sequence_ = 0;  ///< of the previous frame; 0: none
  std::int64_t arrival_ns_ = 0;
  bool any_ = false;  ///< some offset is not zero
};

}  // namespace hapticd::rt
