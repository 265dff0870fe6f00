// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "rt/depth/depth_frame.h"

namespace hapticd::rt {

/// Number of pixels that updatePixels() handles together.
inline constexpr std::size_t kOcclusionBlock = 32;
/// Number of adjacent pixels that share one count of hidden pixels.
inline constexpr std::size_t kOcclusionTile = 64;
/// Flags of a remembered visible value: no measurement now; value offered as hidden.
inline constexpr std::uint16_t kMissing = 0x8000;
inline constexpr std::uint16_t kOffered = 0x4000;
/// Visible value of a pixel without history. No other value, with or without flags, is near it, even where
/// differences wrap around.
inline constexpr std::uint16_t kNothingSeen = 0x3000;
/// Largest tolerance, in raw disparities, that keeps it so.
inline constexpr std::uint16_t kMaxTolerance = 0x0FFF;

/// A tolerance in raw disparities that falls linearly with the disparity, where it is rounded upwards.
struct FallingTolerance {
  std::uint16_t at_zero;   ///< at most kMaxTolerance
  std::uint16_t fall = 0;  ///< per raw disparity, in 65536ths

  std::uint16_t at(std::uint32_t raw) const noexcept {
    return static_cast<std::uint16_t>(at_zero - (raw * fall >> 16));
  }
};

/// State of all pixels of a camera, in frame layout, whose rows are whole numbers of tiles, and the rules by
/// which it follows new measurements. Raw disparities up to `last_raw` are measurements.
struct OcclusionPixels {
  std::size_t rows;
  std::size_t stride_px;
  std::uint16_t* visible;        ///< last visible values with flags, or kNothingSeen
  std::uint16_t* hidden;         ///< surface hidden behind it, or kNoRawDisparity
  std::uint16_t* since;          ///< frame since which the visible surface, or its absence, has been shown
  std::uint8_t* hidden_of_tile;  ///< for each tile, number of pixels that hide something
  /// Consecutive measurements of a surface at rest differ by no more than this in 99 % of cases.
  FallingTolerance rest_noise;
  FallingTolerance min_shell;  ///< changes up to this are no jumps
  /// [last_raw + 1] indexed by nearness; values below are in front of the shell.
  const std::uint16_t* shell_end;
  std::uint16_t last_raw;
  bool falls;                 ///< nearness is last_raw - raw; otherwise it is raw
  std::uint16_t hold_frames;  ///< see OcclusionMemory
  std::uint16_t settled_frames;

  /// Returns `raw` as nearness, which is ordered by depth for either sign of the camera's coefficient; small
  /// is near.
  std::uint16_t nearnessOf(std::uint16_t raw) const noexcept {
    return falls ? static_cast<std::uint16_t>(last_raw - raw) : raw;
  }
};

/// Rows of pixels and the blocks of them to update, all limits inclusive.
struct OcclusionWindow {
  std::size_t row_first;
  std::size_t row_last;
  std::size_t block_first;
  std::size_t block_last;
};

/// Updates all pixels of a window with the new measurements `raw` of frame `now`. Returns the change of the
/// number of pixels that hide something, which is also applied to the tiles. One source serves all vector
/// widths; the width is chosen at run time.  RT: safe after the first call.
int updatePixels(const OcclusionPixels& pixels, const OcclusionWindow& window, const std::uint16_t* raw,
                 std::uint16_t now) noexcept;

}  // namespace hapticd::rt
