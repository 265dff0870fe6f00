// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "rt/depth_model.h"
#include "rt/scene.h"

namespace hapticd::rt {

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
  GridPoint* points_in_image_order;  ///< room for point_capacity and one vector more
  std::uint32_t* pixel_of_row;       ///< of those of a row to look at: kFrameWidth + kVectorPadding
  std::uint32_t* voxel_of_row;  ///< of the points of a row: kFrameWidth + kVectorPadding, from element 1 on
  // Runs: points side by side in the image that lie in the same voxel. Room as for the points.
  std::uint32_t* run_voxel;  ///< bit number in the grid's occupancy
  std::uint32_t* run_begin;  ///< first point; the next run's begin is the end

  // In and out: zero for the first image; those of a further one are appended.
  std::uint32_t points;
  std::uint32_t points_over_capacity;
  std::size_t run_count;  ///< run_begin[run_count] is `points`
};

/// Finds the pixels of the window that have a depth and lie in the ball, in the order of the image, and
/// splits them into runs by voxel. A run does not go on from one row to the next. One source for all vector
/// widths, chosen at run time. RT: safe after the first call. Cost: bounded by the pixels of the window.
void deproject(DeprojectJob& job) noexcept;

}  // namespace hapticd::rt
