#pragma once

#include <cstddef>
#include <cstdint>

#include "rt/surface_field.h"

namespace hapticd::rt {

/// The surface as a block of pixels sees it: a plane in inverse depth, which is a plane in space.
struct alignas(16) SurfacePatch {
  float inverse_depth_per_m;  ///< 1/Z at the block's middle
  float slope_column_per_m;   ///< its change per pixel
  float slope_row_per_m;      ///< and per row
  float plane_distance_m;     ///< from the camera to that plane; 0: nothing is seen
};

/// The disparities of a window of the image, joined to square blocks of pixels. The blocks' arrays have a
/// border of one empty block on each side.
struct BlockImage {
  const float* disparity;  ///< a whole frame, raw units; negative: no measurement
  int column_first, row_first;
  int columns, rows;  ///< pixels
  int block_px;
  int block_columns, block_rows;
  int stride;           ///< from one row of blocks to the next, with borders and padding
  float* column_sum;    ///< [columns + kVectorPadding] working memory
  float* column_count;  ///< the same
  float* count;         ///< [(block_rows + 2) * stride] pixels with a measurement
  float* mean;          ///< the same: their mean disparity

  std::size_t at(int block_row, int block_column) const noexcept {
    return static_cast<std::size_t>(block_row + 1) * static_cast<std::size_t>(stride) +
           static_cast<std::size_t>(block_column) + 1;
  }
};

/// A block shows a surface of its own with that many pixels.
inline float enoughPixels(const BlockImage& image) noexcept {
  return 0.5F * static_cast<float>(image.block_px * image.block_px);
}

/// The count of a block in a gap that was closed: it shows a surface, but any measurement beside it rules.
inline constexpr float kClosedCount = 1e-3F;

/// Fills `count` and `mean`, borders included.  RT: safe after the first call. Cost: one pass over the
/// pixels.
void meanOfBlocks(BlockImage& image) noexcept;

/// Closes gaps between blocks of one row or one column: blocks without enough pixels get the disparities on the
/// straight line between the blocks at the gap's two ends, if the gap is no longer than `longest_px` and the ends
/// differ by no more than `most_raw` plus `most_raw_per_px` times the gap, so that they are of one surface.
/// RT: safe. Cost: two passes over the blocks.
void closeGaps(BlockImage& image, int longest_px, float most_raw, float most_raw_per_px) noexcept;

/// How disparities become patches.
struct PatchFit {
  float edge_raw;  ///< blocks whose means differ by more belong to different surfaces
  float a_per_m, b_per_m;
  float fx_px, fy_px, cx_px, cy_px;
  SurfacePatch* patch;  ///< [as BlockImage::count] out
};

/// Fits a plane in disparity to each block and those of its eight neighbours that belong to the same surface.
/// A block without enough pixels of its own gets one where nearly all its neighbours have them. RT: safe
/// after the first call.
void fitPatches(const BlockImage& image, const PatchFit& fit) noexcept;

/// Where the nodes lie in the camera's frame, and what the camera sees there.
struct NodeJob {
  // position of node (i, j, k) in the camera's frame: origin + i * step_x + j * step_y + k * step_z
  float origin_m[3];
  float step_x_m[3];
  float step_y_m[3];
  float step_z_m[3];
  float fx_px, fy_px, cx_px, cy_px;
  const BlockImage* image;
  const SurfacePatch* patch;
  float truncation_m;
  // Nodes to fill: those in a ball, in units of nodes.
  float ball_x, ball_y, ball_z, ball_radius;
  float* distance_m;  ///< [SurfaceField::kNodes] out
};

/// Signed distances of the nodes in the ball from the patches that their rays meet.  RT: safe after the first
/// call.
void fillNodes(const NodeJob& job) noexcept;

}  // namespace hapticd::rt
