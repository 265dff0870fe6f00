// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "rt/depth/depth_model.h"
#include "rt/scene/scene.h"

namespace hapticd::rt {

/// Input and output of deproject(). Positions are single precision, in metres, along world axes from the
/// grid's origin.
struct DeprojectJob {
  const std::uint16_t* raw;  ///< raw values of one frame, in frame layout
  int stride_px;             ///< distance between rows
  PixelWindow window;        ///< pixels to deproject; not empty
  /// The raw values of the points are among the PackedPixel::kRawRange from here on, or are left out.
  std::uint32_t raw_first;
  const DepthModel::SinglePrecisionTables* tables;
  float camera_x_m, camera_y_m, camera_z_m;
  float ball_x_m, ball_y_m, ball_z_m;
  float ball_radius_squared_m2;  ///< infinity: no limit
  float voxels_per_m;
  std::int32_t last_cell_x, last_cell_y, last_cell_z;
  std::int32_t cells_y;
  std::int32_t bits_per_row;  ///< row length of the occupancy bits

  std::uint32_t point_capacity;
  GridPoint* points_in_image_order;  ///< room for point_capacity and one more vector
  std::uint32_t* pixel_of_row;       ///< selected pixels of one row: stride_px + kVectorPadding elements
  /// Voxels of the points of one row, from element 1 on: stride_px + kVectorPadding elements.
  std::uint32_t* voxel_of_row;
  // A run is a sequence of points adjacent in the image that lie in the same voxel. There is room for as many
  // runs as points.
  std::uint32_t* run_voxel;  ///< bit number in the grid's occupancy
  std::uint32_t* run_begin;  ///< first point of the run; the next run's begin is its end

  // In and out: zero before the first image; the points of further images are appended.
  std::uint32_t points;
  std::uint32_t points_over_capacity;
  std::size_t run_count;  ///< run_begin[run_count] equals `points`
};

/// Finds the pixels of the window that have a depth and lie in the ball, in image order, and splits them into
/// runs by voxel. A run does not continue from one row to the next. One source serves all vector widths; the
/// width is chosen at run time.
/// RT: safe after the first call.  Cost: bounded by the pixels of the window.
void deproject(DeprojectJob& job) noexcept;

}  // namespace hapticd::rt
