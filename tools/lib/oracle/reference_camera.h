// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "rt/base/parameters.h"
#include "rt/base/vec3.h"

namespace hapticd::tools {

/// Eq. (1)-(2) as printed in the paper: the row vector (u v d 1) times the 4x4 matrix, divided by w. Camera
/// frame, extended precision.
rt::Vec3 pointByPrintedMatrix(const rt::DepthModelParameters& parameters, double u, double v, double d);

/// The 4x4 matrix of eq. (1)-(2).
using PrintedMatrix = std::array<std::array<long double, 4>, 4>;

/// The points of one frame in image order, and the pixel and raw value of each.
struct PointCloud {
  std::vector<rt::Vec3> points_m;  ///< world frame
  std::vector<std::uint32_t> column, row, raw;
};

/// A camera according to eq. (1)-(2) and its pose, in extended precision; where it delivers depth instead of
/// disparity, that is Z of eq. (2). Shares no code with rt/.
/// Thread: any.  RT: not safe (allocates).
class ReferenceCamera {
 public:
  explicit ReferenceCamera(const rt::DepthModelParameters& parameters = {},
                           const rt::PoseParameters& pose = {});

  /// Returns whether the raw value is a measurement within the limits.
  bool accepts(std::uint32_t raw) const;
  rt::Vec3 pointInWorld(std::uint32_t column, std::uint32_t row, std::uint32_t raw) const;
  /// Transforms camera coordinates to world coordinates.
  rt::Vec3 toWorld(const rt::Vec3& p_m_in_camera) const;
  /// Returns the points of all pixels that are measurements within the limits. `raw`: height_px rows of equal
  /// length, which begin with the width_px pixels; throws if it has no such rows.
  PointCloud pointsOf(std::span<const std::uint16_t> raw) const;

 private:
  rt::DepthModelParameters camera_;
  rt::PoseParameters pose_;
  PrintedMatrix matrix_;        // of a reciprocal law
  std::vector<bool> accepts_;   // of each raw value
  long double rotation_[3][3];  // world from camera
};

/// Returns the points of all pixels that are measurements within the limits, row by row, in the camera's
/// frame. `raw`: as for ReferenceCamera::pointsOf().
std::vector<rt::Vec3> pointsInCamera(std::span<const std::uint16_t> raw,
                                     const rt::DepthModelParameters& parameters = {});

}  // namespace hapticd::tools
