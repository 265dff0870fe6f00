// SPDX-License-Identifier: Apache-2.0
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rt/modelling/sort_kernel.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
//
#include <algorithm>
#include <numeric>

#include "hwy/highway.h"
#include "rt/modelling/sort_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace hapticd::rt::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr std::uint32_t kWordBits = GridShape::kCellsPerWord;

HWY_INLINE void markVoxels(const DeprojectJob& job, Scene& scene) {
  std::uint64_t* const occupancy = scene.occupancy;
  std::uint64_t* const touched_words = scene.touched_words;
  const std::uint32_t* const run_voxel = job.run_voxel;
  const std::size_t runs = job.run_count;
  for (std::size_t run = 0; run < runs; ++run) {
    const std::uint32_t bit = run_voxel[run];
    const std::uint32_t word = bit / kWordBits;
    occupancy[word] |= 1ULL << (bit % kWordBits);
    touched_words[word / kWordBits] |= 1ULL << (word % kWordBits);
  }
}

/// Assigns ranks to the occupied voxels in the order of their bits; returns their number.
HWY_INLINE std::uint32_t rankWords(Scene& scene) {
  std::uint32_t occupied = 0;
  forEachTouchedWord(scene, [&scene, &occupied](std::size_t word) {
    scene.word_rank[word] = occupied;
    occupied += static_cast<std::uint32_t>(hwy::PopCount(scene.occupancy[word]));
  });
  return occupied;
}

/// Counts the points of each voxel; afterwards voxel_begin[rank + 1] is the index of its first point.
HWY_INLINE void countPoints(const DeprojectJob& job, std::uint32_t occupied, Scene& scene) {
  const std::uint64_t* const occupancy = scene.occupancy;
  const std::uint32_t* const word_rank = scene.word_rank;
  std::uint32_t* const run_voxel = job.run_voxel;
  const std::uint32_t* const run_begin = job.run_begin;
  const std::size_t runs = job.run_count;
  std::uint32_t* const counts = scene.voxel_begin + 2;
  std::fill_n(scene.voxel_begin, occupied + 2, 0U);
  for (std::size_t run = 0; run < runs; ++run) {
    const std::uint32_t bit = run_voxel[run];
    const std::uint64_t below = occupancy[bit / kWordBits] & ((1ULL << (bit % kWordBits)) - 1);
    const std::uint32_t rank = word_rank[bit / kWordBits] + static_cast<std::uint32_t>(hwy::PopCount(below));
    run_voxel[run] = rank;
    counts[rank] += run_begin[run + 1] - run_begin[run];
  }
  std::partial_sum(counts, counts + occupied, counts);
}

/// Copies a run of points. Most runs are short and of unpredictable length, so four points are copied without
/// a branch where masked stores are cheap.
HWY_INLINE void copyRun(const GridPoint* from, GridPoint* to, std::uint32_t count) {
#if HWY_TARGET <= HWY_AVX3
  const hn::FixedTag<float, 16> df;
  constexpr std::uint32_t kNumbers = sizeof(GridPoint) / sizeof(float);
  const float* const from_numbers = reinterpret_cast<const float*>(from);
  float* const to_numbers = reinterpret_cast<float*>(to);
  std::uint32_t number = 0;
  do {
    const auto mask = hn::FirstN(df, std::min(count * kNumbers - number, 16U));
    hn::BlendedStore(hn::LoadU(df, from_numbers + number), mask, df, to_numbers + number);
    number += 16;
  } while (number < count * kNumbers);
#else
  for (std::uint32_t i = 0; i < count; ++i) to[i] = from[i];
#endif
}

/// Moves the runs; voxel_begin[rank + 1] advances to the voxel's end, where the next one begins.
HWY_INLINE void scatter(const DeprojectJob& job, Scene& scene) {
  const GridPoint* const from_points = job.points_in_image_order;
  GridPoint* const to_points = scene.point;
  const std::uint32_t* const run_begin = job.run_begin;
  const std::uint32_t* const run_voxel = job.run_voxel;
  std::uint32_t* const cursors = scene.voxel_begin + 1;
  const std::size_t runs = job.run_count;
  for (std::size_t run = 0; run < runs; ++run) {
    const std::uint32_t begin = run_begin[run];
    const std::uint32_t count = run_begin[run + 1] - begin;
    std::uint32_t& cursor = cursors[run_voxel[run]];
    copyRun(from_points + begin, to_points + cursor, count);
    cursor += count;
  }
}

void sortPoints(const DeprojectJob& job, Scene& scene) {
  markVoxels(job, scene);
  countPoints(job, rankWords(scene), scene);
  scatter(job, scene);
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hapticd::rt {

HWY_EXPORT(sortPoints);

void sortIntoVoxels(const DeprojectJob& job, Scene& scene) noexcept {
  HWY_DYNAMIC_DISPATCH(sortPoints)(job, scene);
}

}  // namespace hapticd::rt
#endif
