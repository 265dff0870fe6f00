// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/modelling/surface/block_image.h"
#include "rt/scene/visible_surface.h"

namespace hapticd::rt {

/// Statistics of blocks; both arrays have BlockLattice layout and end with kVectorPadding spare elements.
struct BlockSums {
  float* disparity;       ///< mean raw value of the nearest surface in the block; negative: too few pixels
  std::uint8_t* is_full;  ///< 1 if all pixels have a measurement and belong to that surface
};

/// Computes `sums`, in the layout of `lattice`, for `blocks` of `image` (frame layout). A difference between
/// adjacent pixels above `max_step` raw units separates two surfaces. Elements behind those of `blocks` in a
/// row become undefined. RT: safe after the first call.
void sumUpBlocks(const std::uint16_t* image, const ImageLayout& layout, const BlockLattice& lattice,
                 const BlockWindow& blocks, int max_step, const BlockSums& sums) noexcept;

}  // namespace hapticd::rt
