// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "rt/depth_frame.h"
#include "rt/parameters.h"
#include "rt/vec3.h"

namespace hapticd::tools {

/// The surface that a depth image itself shows: its disparities, interpolated linearly between neighbouring
/// pixels. The closest point is found by plain search in double precision: what a constraint law is to hold
/// its proxy at on that image. The camera is at the world's origin. Thread: one at a time.
class FrameSurface {
 public:
  /// `disparity`: row by row, of a whole frame; negative where there is none. A view.
  FrameSurface(const float* disparity, const rt::DepthModelParameters& camera)
      : disparity_(disparity), camera_(camera), is_in_sheet_(rt::kFramePixels) {}

  /// The point closest to `hip_m` of the sheet that the line of sight to `hip_m` crosses; nothing where the
  /// HIP is in front of it. Neighbouring pixels belong to one sheet as long as their depths differ by no more
  /// than a surface at 65 degrees to the view, or rounding, explains. Looks no farther than `radius_m`.
  std::optional<rt::Vec3> closestBehind(const rt::Vec3& hip_m, double radius_m);

 private:
  struct Pixel {
    int column;
    int row;
  };
  /// The place between four pixels.
  struct Cell {
    Pixel corner;
    std::array<double, 4> disparity;  ///< of the pixels, row by row
  };
  struct Window {
    int column_first, column_last, row_first, row_last;
  };
  float at(Pixel pixel) const { return disparity_[pixel.row * rt::kFrameWidth + pixel.column]; }
  bool isInSheet(Pixel pixel) const {
    return is_in_sheet_[static_cast<std::size_t>(pixel.row * rt::kFrameWidth + pixel.column)];
  }
  double depthAt(double disparity) const { return 1 / (camera_.a_per_m * disparity + camera_.b_per_m); }
  rt::Vec3 pointAt(double column, double row, double disparity) const;
  bool joined(float a, float b) const;
  std::optional<Pixel> pixelInFrontOf(const rt::Vec3& hip_m) const;
  void fillSheet(Pixel start, const Window& window);
  void clearSheet(const Window& window);
  Pixel closestPixel(const rt::Vec3& hip_m, const Window& window) const;
  /// Nothing where one of the four pixels is not in the sheet.
  std::optional<Cell> cellAt(Pixel corner) const;
  rt::Vec3 pointIn(const Cell& cell, double s, double t) const;
  rt::Vec3 closestIn(const Cell& cell, const rt::Vec3& hip_m) const;

  const float* disparity_;
  rt::DepthModelParameters camera_;
  std::vector<bool> is_in_sheet_;
  std::vector<Pixel> to_visit_;
};

}  // namespace hapticd::tools
