// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>

#include "rt/base/parameters.h"
#include "rt/base/vec3.h"
#include "rt/channels/triple_buffer.h"
#include "rt/depth/depth_model.h"
#include "rt/scene/surface_noise.h"
#include "rt/scene/visible_surface.h"

namespace hapticd::rt {

/// A grid of cubic voxels, axis-aligned in the world frame. Rows of voxels run along x; each row is a
/// sequence of 64-bit words with one bit per voxel.
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
  /// Returns the number of words of the summary, which has one bit per word of the occupancy.
  std::size_t summaryWords() const noexcept { return words() / kCellsPerWord + 1; }

  /// Returns the window that follows the HIP or the grid over the camera's whole view, depending on
  /// `parameters.extent`.
  static GridShape of(const GridParameters& parameters, const DepthModel& model) noexcept;
};

/// A point as stored in the grid: 16 bytes, so that one store moves it and a vector of points is contiguous.
struct alignas(16) GridPoint {
  float x_m, y_m, z_m;  ///< relative to the grid's origin, single precision
  std::uint32_t pixel;  ///< PackedPixel, from which the exact position follows
};

/// Points of one depth frame sorted by voxel, so that the points of a row of voxels are contiguous. Only
/// occupied voxels take memory: the rank of a voxel among the occupied ones is `word_rank` plus the number of
/// set bits below its own. A view; SceneStorage owns the memory.
/// Thread: immutable once published.
struct Scene {
  std::uint64_t frame = 0;         ///< sequence number of the depth frame; 0: nothing modelled yet
  std::uint64_t model = 0;         ///< number of this scene, starting at 1
  std::int64_t frame_time_ns = 0;  ///< CLOCK_MONOTONIC of the frame's arrival
  std::int64_t exposure_ns = 0;    ///< CLOCK_MONOTONIC at mid-exposure; 0: the camera does not state it
  const DepthModel* depth_model = nullptr;

  Vec3 origin_m_in_world;  ///< lowest corner of the grid
  GridShape shape;
  Vec3 ball_centre_m_in_world;  ///< centre of the ball whose points are modelled
  double ball_radius_m = 0;     ///< infinite: the whole frame
  std::uint32_t raw_first = 0;  ///< the raw values of the points are the PackedPixel::kRawRange from here on
  std::uint32_t points = 0;
  std::uint32_t points_over_capacity = 0;

  std::uint64_t* occupancy = nullptr;      ///< [words] one bit per voxel
  std::uint64_t* touched_words = nullptr;  ///< one bit per word of the occupancy that is not 0
  std::uint32_t* word_rank = nullptr;      ///< [words] valid where the occupancy is not 0
  std::uint32_t* voxel_begin = nullptr;    ///< [occupied voxels + 1] first point of each voxel, and the end
  GridPoint* point = nullptr;              ///< [points]

  bool has_points = true;          ///< the points above are modelled
  bool has_image = false;          ///< the image below is modelled
  PixelWindow image_window;        ///< part of the image that is valid
  std::uint16_t* image = nullptr;  ///< raw values of the points, in frame layout; only image_window is valid
  bool has_surface = false;        ///< the surface below is modelled
  VisibleSurface surface;
  SurfaceNoise noise;  ///< of the surface next to the focus, from this and the previous frames

  /// Returns true if the scene contains all points of the frame within `radius_m` of `centre_m_in_world`.
  /// RT: safe.
  bool covers(const Vec3& centre_m_in_world, double radius_m) const noexcept {
    return frame != 0 && has_points &&
           norm(centre_m_in_world - ball_centre_m_in_world) + radius_m <= ball_radius_m;
  }
};
static_assert(std::is_trivially_copyable_v<Scene>);

/// Calls `visit(word)` with the index of each word of the occupancy that is not 0, in ascending order.
/// RT: safe.
template <typename Visit>
void forEachTouchedWord(const Scene& scene, Visit visit) {
  const std::size_t summary_words = scene.shape.summaryWords();
  for (std::size_t summary = 0; summary < summary_words; ++summary) {
    for (std::uint64_t bits = scene.touched_words[summary]; bits != 0; bits &= bits - 1) {
      visit(summary * GridShape::kCellsPerWord + static_cast<std::size_t>(std::countr_zero(bits)));
    }
  }
}

/// Carries scenes from the scene thread (writer) to the force thread (reader).
using SceneChannel = TripleBuffer<Scene>;

/// Owns the memory of one Scene, allocated at start.  RT: not safe.
class SceneStorage {
 public:
  /// Allocates memory for a grid, `point_capacity` points and images of the size of `model`.
  SceneStorage(const GridShape& shape, std::size_t point_capacity, const DepthModel& model);
  /// Attaches `scene` to this memory, which holds an empty grid.
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
    explicit Layer(const DepthModel& model);
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
