// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>

#include "rt/depth_model.h"
#include "rt/parameters.h"
#include "rt/triple_buffer.h"
#include "rt/vec3.h"
#include "rt/visible_surface.h"

namespace hapticd::rt {

/// The most lanes of 32 bits that a vector register of any supported machine holds. Arrays that kernels read
/// or write in whole vectors end with that many spare elements.
inline constexpr std::size_t kVectorPadding = 64;

/// A grid of cubic voxels, axis-aligned in the world. Rows of voxels run along x; each row is a sequence of
/// 64-bit words, one bit per voxel.
struct GridShape {
  int cells_x = 0;
  int cells_y = 0;
  int cells_z = 0;
  double voxel_edge_m = 0;

  static constexpr int kCellsPerWord = 64;
  int wordsPerRow() const noexcept { return (cells_x + kCellsPerWord - 1) / kCellsPerWord; }
  std::size_t words() const noexcept {
    return static_cast<std::size_t>(wordsPerRow()) * static_cast<std::size_t>(cells_y) *
           static_cast<std::size_t>(cells_z);
  }
  /// Words of the summary that has one bit per word of the occupancy.
  std::size_t summaryWords() const noexcept { return words() / kCellsPerWord + 1; }

  /// The window that follows the HIP, or the grid over all that the camera sees, as `parameters.extent` says.
  static GridShape of(const GridParameters& parameters, const DepthModel& model) noexcept;
};

/// A point as the grid keeps it: one store to move it, and a vector of them is one stretch of memory.
struct alignas(16) GridPoint {
  float x_m, y_m, z_m;  ///< from the grid's origin, single precision
  std::uint32_t pixel;  ///< PackedPixel, for the exact position
};

/// Points of one depth frame, sorted by voxel: those of a row of voxels lie one after the other. Only
/// occupied voxels take memory: a voxel's rank among the occupied ones is `word_rank` plus the set bits below
/// its own. A view; a SceneStorage owns the memory. Immutable once published.
struct Scene {
  std::uint64_t frame = 0;         ///< sequence number of the depth frame, 0: nothing modelled yet
  std::uint64_t model = 0;         ///< number of this scene, from 1 on
  std::int64_t frame_time_ns = 0;  ///< CLOCK_MONOTONIC of the frame's arrival
  const DepthModel* depth_model = nullptr;

  Vec3 origin_m_in_world;  ///< lowest corner of the grid
  GridShape shape;
  Vec3 ball_centre_m_in_world;  ///< the part of the frame that is modelled: all points in this ball
  double ball_radius_m = 0;     ///< infinite: the whole frame
  std::uint32_t points = 0;
  std::uint32_t points_over_capacity = 0;

  std::uint64_t* occupancy = nullptr;      ///< [words] one bit per voxel
  std::uint64_t* touched_words = nullptr;  ///< one bit per word of the occupancy: it is not 0
  std::uint32_t* word_rank = nullptr;      ///< [words] valid where occupancy is not 0
  std::uint32_t* voxel_begin = nullptr;    ///< [occupied voxels + 1] first point of each, and the end
  GridPoint* point = nullptr;              ///< [points]

  bool has_points = true;          ///< the points above are modelled
  bool has_image = false;          ///< the image below is modelled
  PixelWindow image_window;        ///< of the image
  std::uint16_t* image = nullptr;  ///< [kFramePixels] raw values as the points come from, in the window only
  bool has_surface = false;        ///< the surface below is modelled
  VisibleSurface surface;

  /// True if all points of the frame within `radius_m` of `centre_m_in_world` are in the scene.  RT: safe.
  bool covers(const Vec3& centre_m_in_world, double radius_m) const noexcept {
    return frame != 0 && has_points &&
           norm(centre_m_in_world - ball_centre_m_in_world) + radius_m <= ball_radius_m;
  }
};
static_assert(std::is_trivially_copyable_v<Scene>);

/// Calls `visit(word)` for each word of the scene's occupancy that is not 0, in ascending order.  RT: safe.
template <typename Visit>
void forEachTouchedWord(const Scene& scene, Visit visit) {
  const std::size_t summary_words = scene.shape.summaryWords();
  for (std::size_t summary = 0; summary < summary_words; ++summary) {
    for (std::uint64_t bits = scene.touched_words[summary]; bits != 0; bits &= bits - 1) {
      visit(summary * GridShape::kCellsPerWord + static_cast<std::size_t>(std::countr_zero(bits)));
    }
  }
}

/// From the scene thread (writer) to the force thread (reader).
using SceneChannel = TripleBuffer<Scene>;

/// The memory of one Scene.  RT: not safe (allocated at start).
class SceneStorage {
 public:
  SceneStorage(const GridShape& shape, std::size_t point_capacity);
  /// Points `scene` at this memory, which holds an empty grid.
  void attachTo(Scene& scene) const noexcept;

 private:
  GridShape shape_;
  std::unique_ptr<std::uint64_t[]> occupancy_;
  std::unique_ptr<std::uint64_t[]> touched_words_;
  std::unique_ptr<std::uint32_t[]> word_rank_;
  std::unique_ptr<std::uint32_t[]> voxel_begin_;
  std::unique_ptr<GridPoint[]> point_;
  std::unique_ptr<std::uint16_t[]> image_;
  struct Layer {
    Layer();
    void attachTo(SurfaceLayer& layer) const noexcept;

   private:
    std::unique_ptr<std::uint16_t[]> image_;
    std::unique_ptr<Facet[]> facet_;
    std::unique_ptr<Cell[]> cell_;
  };
  Layer visible_;
  Layer hidden_;
};

}  // namespace hapticd::rt
