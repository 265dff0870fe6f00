#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rt/sort_kernel.cpp"
#include "hwy/foreach_target.h"  // IWYU pragma: keep
//
#include <algorithm>

#include "hwy/highway.h"
#include "rt/sort_kernel.h"

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

/// Numbers the occupied voxels in the order of their bits; returns how many there are.
HWY_INLINE std::uint32_t rankWords(Scene& scene) {
  std::uint32_t occupied = 0;
  forEachTouchedWord(scene, [&scene, &occupied](std::size_t word) {
    scene.word_rank[word] = occupied;
    occupied += static_cast<std::uint32_t>(hwy::PopCount(scene.occupancy[word]));
  });
  return occupied;
}

/// Counts the points of each voxel; afterwards voxel_begin[rank + 1] is where its first point goes and
/// voxel_end[rank] where its last one ends.
HWY_INLINE void countPoints(const DeprojectJob& job, std::uint32_t occupied, std::uint32_t* voxel_end,
                            Scene& scene) {
  const std::uint64_t* const occupancy = scene.occupancy;
  const std::uint32_t* const word_rank = scene.word_rank;
  std::uint32_t* const run_voxel = job.run_voxel;
  const std::uint32_t* const run_begin = job.run_begin;
  const std::size_t runs = job.run_count;
  std::fill_n(voxel_end, occupied, 0U);
  for (std::size_t run = 0; run < runs; ++run) {
    const std::uint32_t bit = run_voxel[run];
    const std::uint64_t below = occupancy[bit / kWordBits] & ((1ULL << (bit % kWordBits)) - 1);
    const std::uint32_t rank =
        word_rank[bit / kWordBits] + static_cast<std::uint32_t>(hwy::PopCount(below));
    run_voxel[run] = rank;
    voxel_end[rank] += run_begin[run + 1] - run_begin[run];
  }
  std::uint32_t sum = 0;
  scene.voxel_begin[0] = 0;
  for (std::uint32_t rank = 0; rank < occupied; ++rank) {
    scene.voxel_begin[rank + 1] = sum;
    sum += voxel_end[rank];
    voxel_end[rank] = sum;
  }
}

/// Copies four points.
HWY_INLINE void copyFour(const GridPoint* from, GridPoint* to) {
  const hn::CappedTag<float, 16> df;
  for (std::size_t part = 0; part < 16; part += hn::Lanes(df)) {
    hn::StoreU(hn::LoadU(df, &from->x_m + part), df, &to->x_m + part);
  }
}

/// Moves the runs; voxel_begin[rank + 1] runs on to the voxel's end, which is where the next one begins.
HWY_INLINE void scatter(const DeprojectJob& job, const std::uint32_t* voxel_end, Scene& scene) {
  constexpr std::uint32_t kAtOnce = 4;
  const GridPoint* const from_points = job.points_in_image_order;
  GridPoint* const to_points = scene.point;
  const std::uint32_t* const run_begin = job.run_begin;
  const std::uint32_t* const run_voxel = job.run_voxel;
  std::uint32_t* const cursors = scene.voxel_begin + 1;
  const std::size_t runs = job.run_count;
  for (std::size_t run = 0; run < runs; ++run) {
    std::uint32_t from = run_begin[run];
    const std::uint32_t end = run_begin[run + 1];
    const std::uint32_t rank = run_voxel[run];
    std::uint32_t to = cursors[rank];
    cursors[rank] = to + end - from;
    // Most runs are short and of no predictable length. Four points are moved without asking as long as what
    // is written too much stays in the voxel, where later runs overwrite it.
    if (to + (end - from) + kAtOnce - 1 <= voxel_end[rank]) {
      copyFour(from_points + from, to_points + to);
      for (from += kAtOnce, to += kAtOnce; from < end; from += kAtOnce, to += kAtOnce) {
        copyFour(from_points + from, to_points + to);
      }
    } else {
      while (from < end) to_points[to++] = from_points[from++];
    }
  }
}

void sortPoints(const DeprojectJob& job, std::uint32_t* voxel_end, Scene& scene) {
  markVoxels(job, scene);
  countPoints(job, rankWords(scene), voxel_end, scene);
  scatter(job, voxel_end, scene);
}

}  // namespace hapticd::rt::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace hapticd::rt {

HWY_EXPORT(sortPoints);

void sortIntoVoxels(const DeprojectJob& job, std::uint32_t* voxel_end, Scene& scene) noexcept {
  HWY_DYNAMIC_DISPATCH(sortPoints)(job, voxel_end, scene);
}

}  // namespace hapticd::rt
#endif
