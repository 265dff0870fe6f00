// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "rt/scene/disparity_motion.h"
#include "rt/scene/visible_surface.h"

namespace hapticd::rt {

/// Mean disparities of the blocks of a layer over the last frames. The arrays have BlockLattice layout and
/// end with kVectorPadding spare elements.
struct BlockMeans {
  std::unique_ptr<float[]> disparity;        ///< raw units; negative: no measurement
  std::unique_ptr<float[]> frames;           ///< number of frames in the mean
  std::unique_ptr<std::uint32_t[]> updated;  ///< frame of the last update

  /// RT: not safe (allocates).
  explicit BlockMeans(const BlockLattice& lattice);
};

/// Blocks of a range of disparities.
struct BlockRegion {
  BlockWindow blocks;
  float disparity_least;
  float disparity_greatest;
};

/// A DisparityMotion by blocks instead of pixels, counted from some first block.
struct BlockMotion {
  float first;       ///< at the first block
  float per_column;  ///< change per block to the right
  float per_row;     ///< and downwards

  /// As seen from the block in that row and column.
  static BlockMotion of(const DisparityMotion& motion, int first_row, int first_column) noexcept;
  float atRow(int row) const noexcept { return first + per_row * static_cast<float>(row); }
};

/// How means follow a new frame.
struct MeansUpdate {
  std::uint32_t sequence;  ///< of the new frame
  std::uint32_t before;    ///< of the frame that is continued; 0: none
  float max_frames;        ///< length of the means
  float most_raw;          ///< blocks that differ from their mean by more start again
  BlockRegion region;      ///< where the surface moves and innovations are summed up
  BlockMotion moved_raw;   ///< motion in the region since the frame before, by blocks of the lattice
  float farthest_raw;      ///< larger innovations are left out of the sum
};

/// Differences between new disparities of blocks and the expected ones: what a least-squares fit that is
/// affine in the image needs. Sums over the blocks, of the products that the members are named after.
struct Innovations {
  /// Raw units. The order of the blocks does not matter: a double holds any sum of differences between
  /// single-precision disparities, times numbers of blocks, exactly.
  double raw = 0;
  double raw_column = 0;  ///< columns and rows: of blocks in the lattice
  double raw_row = 0;
  double count = 0;
  double column = 0;
  double row = 0;
  double column_column = 0;
  double column_row = 0;
  double row_row = 0;
};

/// Updates the means of `blocks` that have not seen the frame yet. `observed_raw`: new disparities of blocks,
/// in the layout of the means, negative where nothing is measured, from which `offset_raw`, by columns of
/// blocks, is subtracted; both with kVectorPadding spare elements.  RT: safe after the first call.
void followBlocks(const BlockLattice& lattice, const BlockWindow& blocks, const float* observed_raw,
                  const float* offset_raw, const MeansUpdate& update, BlockMeans& means,
                  Innovations& innovations) noexcept;

/// Where the means `to` know neither the frame `before` nor `sequence`, continues them from the means `from`
/// if these know the frame `before`.  RT: safe after the first call.
void continueBlocks(const BlockLattice& lattice, const BlockWindow& blocks, std::uint32_t before,
                    std::uint32_t sequence, const BlockMeans& from, BlockMeans& to) noexcept;

}  // namespace hapticd::rt
