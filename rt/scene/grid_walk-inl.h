// SPDX-License-Identifier: Apache-2.0
// Included once per vector target, after the kernels' includes and before their HWY_BEFORE_NAMESPACE.
#if defined(HAPTICD_RT_GRID_WALK_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef HAPTICD_RT_GRID_WALK_INL_H_
#undef HAPTICD_RT_GRID_WALK_INL_H_
#else
#define HAPTICD_RT_GRID_WALK_INL_H_
#endif

#include <algorithm>
#include <cmath>

#include "hwy/highway.h"
#include "rt/scene/search_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {

/// First and last cell along one axis that an interval of positions meets; empty when first > last.
struct CellRange {
  int first;
  int last;
};

HWY_INLINE CellRange cellsOf(float low_m, float high_m, float voxels_per_m, int cells) {
  if (high_m < 0 || low_m * voxels_per_m >= static_cast<float>(cells)) return {0, -1};
  return {static_cast<int>(std::max(low_m * voxels_per_m, 0.0F)),
          static_cast<int>(std::min(high_m * voxels_per_m, static_cast<float>(cells - 1)))};
}

/// Returns the distance along one axis from a position to a cell; 0 inside the cell.
HWY_INLINE float distanceToCell(float position_m, int cell, float voxel_edge_m) {
  const float low = static_cast<float>(cell) * voxel_edge_m;
  return std::max({0.0F, low - position_m, position_m - (low + voxel_edge_m)});
}

/// Calls `visit(begin, end)` with ranges of points that together are all points in the cells `range` of one
/// row of voxels.
template <typename Visit>
HWY_INLINE void walkRow(const Scene& scene, std::size_t row_word, CellRange range, const Visit& visit) {
  constexpr int kBits = GridShape::kCellsPerWord;
  for (int word = range.first / kBits; word <= range.last / kBits; ++word) {
    const std::size_t index = row_word + static_cast<std::size_t>(word);
    const int first_bit = std::max(range.first - word * kBits, 0);
    const int last_bit = std::min(range.last - word * kBits, kBits - 1);
    const std::uint64_t occupied = scene.occupancy[index];
    const std::uint64_t met = occupied & (~0ULL << first_bit) & (~0ULL >> (kBits - 1 - last_bit));
    if (met == 0) continue;
    const std::uint32_t rank =
        scene.word_rank[index] +
        static_cast<std::uint32_t>(hwy::PopCount(occupied & ((1ULL << first_bit) - 1)));
    const std::uint32_t end_rank = rank + static_cast<std::uint32_t>(hwy::PopCount(met));
    visit(scene.voxel_begin[rank], scene.voxel_begin[end_rank]);
  }
}

/// Calls `visit(begin, end)` with ranges of points that together include all points in the ball.
template <typename Visit>
HWY_INLINE void walkBall(const Scene& scene, const LocalBall& ball, const Visit& visit) {
  const auto edge = static_cast<float>(scene.shape.voxel_edge_m);
  const float voxels_per_m = 1 / edge;
  // The voxel index of a point and the range of cells are rounded differently; a slightly larger radius
  // compensates.
  const float radius = ball.radius_m + static_cast<float>(scene.depth_model->singlePrecisionError_m());
  const float radius_squared = radius * radius;
  const auto words_per_row = static_cast<std::size_t>(scene.shape.wordsPerRow());
  const CellRange layers = cellsOf(ball.z_m - radius, ball.z_m + radius, voxels_per_m, scene.shape.cells_z);
  const CellRange rows = cellsOf(ball.y_m - radius, ball.y_m + radius, voxels_per_m, scene.shape.cells_y);
  for (int cell_z = layers.first; cell_z <= layers.last; ++cell_z) {
    const float dz = distanceToCell(ball.z_m, cell_z, edge);
    for (int cell_y = rows.first; cell_y <= rows.last; ++cell_y) {
      const float dy = distanceToCell(ball.y_m, cell_y, edge);
      const float half_chord_squared = radius_squared - dz * dz - dy * dy;
      if (half_chord_squared < 0) continue;
      const float half_chord = std::sqrt(half_chord_squared);
      const CellRange cells =
          cellsOf(ball.x_m - half_chord, ball.x_m + half_chord, voxels_per_m, scene.shape.cells_x);
      if (cells.first > cells.last) continue;
      const auto row = static_cast<std::size_t>(cell_z) * static_cast<std::size_t>(scene.shape.cells_y) +
                       static_cast<std::size_t>(cell_y);
      walkRow(scene, row * words_per_row, cells, visit);
    }
  }
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
