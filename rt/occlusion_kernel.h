#pragma once

#include <cstddef>
#include <cstdint>

namespace hapticd::rt {

/// Pixels that occlusionRow() passes over or reports together.
inline constexpr std::size_t kOcclusionBlock = 32;
/// A pixel without measurement, and a pixel of which nothing is remembered.
inline constexpr std::uint16_t kNothingSeen = 0xFFFF;

/// Part of a row of pixels, a whole number of blocks.
struct OcclusionRow {
  const std::uint16_t* raw;     ///< newly seen; above `last_raw`: no measurement
  std::uint16_t* visible;       ///< last seen, or another value above `last_raw`, such as kNothingSeen
  const std::uint16_t* hidden;  ///< what is hidden behind it, or `no_hidden`; null: nothing is, anywhere
  std::size_t blocks;
  std::uint16_t last_raw;
  std::uint16_t no_hidden;
  std::uint16_t most_raw;  ///< by which a value changes that is taken over
};

/// Takes over the new values of all blocks whose pixels show what they showed before, up to noise, and
/// nothing that could be what was hidden there. The numbers of the other blocks, which are left as they were,
/// go to `changed` (room for as many as there are blocks); returns how many those are. To `unmeasured` the
/// pixels without measurement in the blocks taken over are added. One source for all vector widths, chosen at
/// run time.  RT: safe after the first call.
std::size_t takeUnchanged(const OcclusionRow& row, std::uint8_t* changed) noexcept;

}  // namespace hapticd::rt
