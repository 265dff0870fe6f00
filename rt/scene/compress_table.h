// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace hapticd::rt {

/// For each mask of 8 lanes: the indices of its set lanes in ascending order, then those of the other lanes.
/// The first four entries also serve vectors of 4 lanes.
inline constexpr auto kCompressLanes = [] {
  constexpr std::uint32_t kLanes = 8;
  std::array<std::array<std::int32_t, kLanes>, 1U << kLanes> table{};
  for (std::uint32_t mask = 0; mask < table.size(); ++mask) {
    std::size_t next = 0;
    for (const std::uint32_t bit : {1U, 0U}) {
      for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
        if (((mask >> lane) & 1U) == bit) table[mask][next++] = static_cast<std::int32_t>(lane);
      }
    }
  }
  return table;
}();

}  // namespace hapticd::rt
