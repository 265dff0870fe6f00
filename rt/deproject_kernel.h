#pragma once

#include <cstddef>
#include <cstdint>

#include "rt/depth_model.h"

namespace hapticd::rt {

/// Pixels side by side in the image whose points lie in the same voxel.
struct VoxelRun {
  std::uint32_t voxel;  ///< bit number in the grid's occupancy; later the voxel's rank among the occupied
  std::uint32_t begin;  ///< first point of the run; the next run's begin is its end
};

/// A point as the builder moves it: one store, one cache line.
struct alignas(16) BuilderPoint {
  float x_m, y_m, z_m;  ///< from the grid's origin
  std::uint32_t pixel;  ///< PackedPixel
};

/// What deproject() reads and where it writes. Positions are single precision, metres, in world axes from the
/// grid's origin.
struct DeprojectJob {
  const std::uint16_t* raw;  ///< a whole frame
  PixelWindow window;        ///< not empty
  const DepthModel::SinglePrecisionTables* tables;
  float camera_x_m, camera_y_m, camera_z_m;
  float ball_x_m, ball_y_m, ball_z_m;
  float ball_radius_squared_m2;  ///< infinite: no point is too far
  float voxels_per_m;
  std::int32_t last_cell_x, last_cell_y, last_cell_z;
  std::int32_t cells_y;
  std::int32_t bits_per_row;  ///< of the occupancy

  std::uint32_t point_capacity;
  BuilderPoint* points_in_image_order;  ///< room for point_capacity and one vector more
  std::uint32_t* voxel;                 ///< voxel[-1] may be written
  VoxelRun* runs;                       ///< room for point_capacity + 1
  std::uint64_t* occupancy;             ///< all 0 on entry
  std::uint64_t* touched_words;         ///< all 0 on entry

  std::uint32_t points;                ///< out
  std::uint32_t points_over_capacity;  ///< out
  std::size_t run_count;               ///< out; runs[run_count].begin is `points`
};

/// Deprojects the pixels of the window that have a depth and lie in the ball, in the order of the image, and
/// splits them into runs by voxel. One source for all vector widths, chosen at run time.
/// RT: safe after the first call. Cost: bounded by the pixels of the window.
void deproject(DeprojectJob& job) noexcept;

/// Splits `count` points into arrays of their coordinates; all have room for one vector more.
/// RT: safe after the first call.
void splitCoordinates(const BuilderPoint* points, std::uint32_t count, float* x_m, float* y_m, float* z_m,
                      std::uint32_t* pixel) noexcept;

}  // namespace hapticd::rt
