#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rt/search_kernel.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
//
#include <algorithm>
#include <bit>
#include <cmath>

#include "hwy/highway.h"
#include "rt/search_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using FloatTag = hn::ScalableTag<float>;
using UintTag = hn::RebindToUnsigned<FloatTag>;

/// First and last cell of an axis that an interval of positions meets; empty when first > last.
struct CellRange {
  int first;
  int last;
};

HWY_INLINE CellRange cellsOf(float low_m, float high_m, float voxels_per_m, int cells) {
  if (high_m < 0 || low_m * voxels_per_m >= static_cast<float>(cells)) return {0, -1};
  return {static_cast<int>(std::max(low_m * voxels_per_m, 0.0F)),
          static_cast<int>(std::min(high_m * voxels_per_m, static_cast<float>(cells - 1)))};
}

/// Distance on one axis from a position to a cell; 0 inside it.
HWY_INLINE float distanceToCell(float position_m, int cell, float voxel_edge_m) {
  const float low = static_cast<float>(cell) * voxel_edge_m;
  return std::max({0.0F, low - position_m, position_m - (low + voxel_edge_m)});
}

/// Appends those of the points [begin, end) that lie in the ball.
HWY_INLINE void appendPoints(const Scene& scene, const LocalBall& ball, std::uint32_t begin,
                             std::uint32_t end, Candidates& candidates) {
  const FloatTag df;
  const UintTag du;
  const auto lanes = static_cast<std::uint32_t>(hn::Lanes(df));
  const auto centre_x = hn::Set(df, ball.x_m);
  const auto centre_y = hn::Set(df, ball.y_m);
  const auto centre_z = hn::Set(df, ball.z_m);
  const auto limit = hn::Set(df, ball.radius_m * ball.radius_m);
  for (std::uint32_t i = begin; i < end; i += lanes) {
    const auto x = hn::Sub(hn::LoadU(df, scene.x_m + i), centre_x);
    const auto y = hn::Sub(hn::LoadU(df, scene.y_m + i), centre_y);
    const auto z = hn::Sub(hn::LoadU(df, scene.z_m + i), centre_z);
    const auto distance_squared = hn::MulAdd(z, z, hn::MulAdd(y, y, hn::Mul(x, x)));
    auto inside = hn::Le(distance_squared, limit);
    if (end - i < lanes) inside = hn::And(inside, hn::FirstN(df, end - i));
    const auto found = static_cast<std::uint32_t>(hn::CountTrue(df, inside));
    if (found == 0) continue;
    hn::StoreU(hn::Compress(distance_squared, inside), df, candidates.distance_squared_m2 + candidates.count);
    hn::StoreU(hn::Compress(hn::LoadU(du, scene.pixel + i), hn::RebindMask(du, inside)), du,
               candidates.pixel + candidates.count);
    candidates.count += found;
  }
}

/// Appends the points of the cells `range` of one row of voxels.
HWY_INLINE void appendRow(const Scene& scene, const LocalBall& ball, std::size_t row_word, CellRange range,
                          Candidates& candidates) {
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
        static_cast<std::uint32_t>(std::popcount(occupied & ((1ULL << first_bit) - 1)));
    const std::uint32_t end_rank = rank + static_cast<std::uint32_t>(std::popcount(met));
    appendPoints(scene, ball, scene.voxel_begin[rank], scene.voxel_begin[end_rank], candidates);
  }
}

void findInBallOfGrid(const Scene& scene, const LocalBall& ball, Candidates& candidates) {
  candidates.count = 0;
  const auto edge = static_cast<float>(scene.shape.voxel_edge_m);
  const float voxels_per_m = 1 / edge;
  // A point's voxel index and the cells met are rounded apart; a little more radius makes up for it.
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
      appendRow(scene, ball, row * words_per_row, cells, candidates);
    }
  }
}

std::uint32_t countCandidatesWithin(const Candidates& candidates, float limit_m2) {
  const FloatTag df;
  const auto lanes = static_cast<std::uint32_t>(hn::Lanes(df));
  const auto limit = hn::Set(df, limit_m2);
  std::uint32_t within = 0;
  for (std::uint32_t i = 0; i < candidates.count; i += lanes) {
    auto inside = hn::Le(hn::LoadU(df, candidates.distance_squared_m2 + i), limit);
    if (candidates.count - i < lanes) inside = hn::And(inside, hn::FirstN(df, candidates.count - i));
    within += static_cast<std::uint32_t>(hn::CountTrue(df, inside));
  }
  return within;
}

std::uint32_t takeCandidatesBetween(Candidates& candidates, float near_m2, float far_m2,
                                    std::uint32_t* between) {
  const FloatTag df;
  const UintTag du;
  const auto lanes = static_cast<std::uint32_t>(hn::Lanes(df));
  const auto near_limit = hn::Set(df, near_m2);
  const auto far_limit = hn::Set(df, far_m2);
  std::uint32_t near = 0;
  std::uint32_t taken = 0;
  for (std::uint32_t i = 0; i < candidates.count; i += lanes) {
    const auto distance = hn::LoadU(df, candidates.distance_squared_m2 + i);
    const auto pixel = hn::LoadU(du, candidates.pixel + i);
    auto within = hn::Le(distance, far_limit);
    if (candidates.count - i < lanes) within = hn::And(within, hn::FirstN(df, candidates.count - i));
    const auto is_near = hn::And(within, hn::Le(distance, near_limit));
    const auto is_between = hn::AndNot(is_near, within);
    // In place: what is overwritten behind `near` has been loaded already.
    hn::StoreU(hn::Compress(pixel, hn::RebindMask(du, is_near)), du, candidates.pixel + near);
    near += static_cast<std::uint32_t>(hn::CountTrue(df, is_near));
    if (hn::AllFalse(df, is_between)) continue;
    hn::StoreU(hn::Compress(pixel, hn::RebindMask(du, is_between)), du, between + taken);
    taken += static_cast<std::uint32_t>(hn::CountTrue(df, is_between));
  }
  candidates.count = near;
  return taken;
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hapticd::rt {

HWY_EXPORT(findInBallOfGrid);
HWY_EXPORT(countCandidatesWithin);
HWY_EXPORT(takeCandidatesBetween);

void findInBall(const Scene& scene, const LocalBall& ball, Candidates& candidates) noexcept {
  HWY_DYNAMIC_DISPATCH(findInBallOfGrid)(scene, ball, candidates);
}

std::uint32_t countWithin(const Candidates& candidates, float limit_m2) noexcept {
  return HWY_DYNAMIC_DISPATCH(countCandidatesWithin)(candidates, limit_m2);
}

std::uint32_t takeBetween(Candidates& candidates, float near_m2, float far_m2,
                          std::uint32_t* between) noexcept {
  return HWY_DYNAMIC_DISPATCH(takeCandidatesBetween)(candidates, near_m2, far_m2, between);
}

}  // namespace hapticd::rt
#endif
