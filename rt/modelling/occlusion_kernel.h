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

/// One row of pixels and the range of its blocks to update. Raw disparities up to
/// `last_raw` are measurements.
struct OcclusionRow {
  const std::uint16_t* raw;      ///< new measurements
  std::uint16_t* visible;        ///< last visible values with flags, or kNothingSeen
  std::uint16_t* hidden;         ///< surface hidden behind it, or kNoRawDisparity
  std::uint16_t* since;          ///< frame since which the visible surface, or its absence, has been shown
  std::uint8_t* hidden_of_tile;  ///< for each tile, number of pixels that hide something
  bool hides;                    ///< false: no pixel hides anything
  std::size_t block_first;
  std::size_t block_last;
  std::size_t ahead;  ///< distance in pixels from this row to the one to prefetch
  /// Consecutive measurements of a surface at rest differ by no more than this in 99 % of cases.
  FallingTolerance rest_noise;
  FallingTolerance min_shell;  ///< changes up to this are no jumps
  /// [last_raw + 1] indexed by nearness; values below are in front of the shell.
  const std::uint16_t* shell_end;
  std::uint16_t last_raw;
  bool falls;                 ///< nearness is last_raw - raw; otherwise it is raw
  std::uint16_t now;          ///< current frame
  std::uint16_t hold_frames;  ///< see OcclusionMemory
  std::uint16_t settled_frames;
};

/// Result of updatePixels().
struct OcclusionLeft {
  int more_hidden = 0;  ///< change of the number of pixels that hide something; also applied to the tiles
  std::uint64_t overdue_blocks = 0;  ///< blocks with overdue pixels, one bit each
  /// Of these blocks, and meaningless of others: the overdue pixels, one bit each.
  std::uint32_t overdue_pixels[kMaxFrameWidth / kOcclusionBlock];
};

/// Updates all pixels of a row with new measurements, except overdue ones: those without measurement for
/// `hold_frames` or longer. One source serves all vector widths; the width is chosen at run time.  RT: safe
/// after the first call.
OcclusionLeft updatePixels(const OcclusionRow& row) noexcept;

}  // namespace hapticd::rt
