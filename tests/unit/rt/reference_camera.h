// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "rt/depth_frame.h"
#include "rt/parameters.h"
#include "rt/vec3.h"

namespace hapticd::test {

/// Eq. (1)-(2) as printed in the paper: the row vector (u v d 1) times the 4x4 matrix, divided by w. Camera
/// frame, extended precision.
rt::Vec3 pointByPrintedMatrix(const rt::DepthModelParameters& parameters, double u, double v, double d);

/// Points of one frame in image order, as arrays for a fast brute-force search.
struct PointCloud {
  std::vector<double> x_m, y_m, z_m;  ///< world frame
  std::vector<std::uint32_t> column, row, raw;

  std::size_t size() const { return x_m.size(); }
  rt::Vec3 position(std::size_t i) const { return {x_m[i], y_m[i], z_m[i]}; }
};

/// A camera according to eq. (1)-(2) and its pose, in extended precision. Shares no code with rt/.
class ReferenceCamera {
 public:
  explicit ReferenceCamera(const rt::DepthModelParameters& parameters, const rt::PoseParameters& pose = {});

  /// Returns whether the raw value is a measurement within the limits.
  bool accepts(std::uint32_t raw) const;
  rt::Vec3 pointInWorld(std::uint32_t column, std::uint32_t row, std::uint32_t raw) const;
  /// Transforms camera coordinates to world coordinates.
  rt::Vec3 toWorld(const rt::Vec3& p_m_in_camera) const;
  PointCloud pointsOf(const rt::DepthFrame& frame) const;

 private:
  rt::DepthModelParameters parameters_;
  rt::PoseParameters pose_;
  long double rotation_[3][3];  // world from camera
};

}  // namespace hapticd::test
