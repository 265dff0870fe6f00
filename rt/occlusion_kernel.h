// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace hapticd::rt {

/// Pixels that seePixels() reports together, and those of which the hidden ones are counted together.
inline constexpr std::size_t kOcclusionBlock = 32;
inline constexpr std::size_t kOcclusionTile = 64;
/// Flags of a remembered visible value: there is no measurement now; its value is offered as hidden.
inline constexpr std::uint16_t kMissing = 0x8000;
inline constexpr std::uint16_t kOffered = 0x4000;
/// The visible value of a pixel of which nothing is remembered: none of the others, flags or not, is near it,
/// also not where differences wrap around.
inline constexpr std::uint16_t kNothingSeen = 0x2000;
/// Measurements of a surface that rests differ by no more from frame to frame, but for 1 % of them.
inline constexpr std::uint16_t kRestNoise_raw = 2;
/// Where the shell's depth is less than that, far away, noise must not be taken for an occluder.
inline constexpr std::uint16_t kLeastShell_raw = 3;

/// A row of pixels, and which of its blocks to see. Raw values are measurements below kRawNoMeasurement.
struct OcclusionRow {
  const std::uint16_t* raw;      ///< newly seen
  std::uint16_t* visible;        ///< last seen, with flags, or kNothingSeen
  std::uint16_t* hidden;         ///< what is hidden behind it, or kRawNoMeasurement
  std::uint16_t* since;          ///< frame since which the surface, or nothing, has been visible there
  std::uint8_t* hidden_of_tile;  ///< of each tile how many pixels hide something
  bool hides;                    ///< false: none do
  std::size_t block_first;
  std::size_t block_last;
  std::size_t ahead;               ///< pixels from this row to the one to prefetch
  const std::uint16_t* shell_end;  ///< [kRawValues] by nearness: nearer ones are before the shell
  bool falls;                      ///< nearness is kRawNoMeasurement - 1 - raw, otherwise it is raw
  std::uint16_t now;               ///< frame
  std::uint16_t hold_frames;       ///< see OcclusionMemory
  std::uint16_t settled_frames;
};

/// What seePixels() leaves to do.
struct OcclusionLeft {
  int more_hidden = 0;               ///< change of the number of pixels that hide something, as in the tiles
  std::uint32_t overdue_blocks = 0;  ///< those with pixels that are overdue, one bit each
};

/// Takes in the new values of all pixels but for those that are overdue: that have been without measurement
/// for `hold_frames` or longer. One source for all vector widths, chosen at run time.  RT: safe after the
/// first call.
OcclusionLeft seePixels(const OcclusionRow& row) noexcept;

}  // namespace hapticd::rt
