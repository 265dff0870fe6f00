// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "rt/base/vec3.h"
#include "rt/depth/depth_frame_header.h"

namespace hapticd::drivers {

/// The ball around which the scene is modelled.
struct ModelledBall {
  rt::Vec3 centre_m_in_world;
  double radius_m = 0;  ///< 0: none, or the whole frame is modelled
};

/// Converts raw depth images to points in the camera frame (x right, y up, looking along -z), in metres:
/// x, y, z, x, y, z, ... in the order of the image. Pixels without measurement, and those beyond kFarthest_m,
/// have no point.
/// Thread: one.  RT: not safe.
class DepthPoints {
 public:
  /// Farther values are no measurements but next to the pole of a reciprocal depth law.
  static constexpr double kFarthest_m = 20;

  // `image`: the stride_bytes * height_px bytes described by a valid header. The result is valid until the
  // next call.
  /// Every `step`-th pixel of every `step`-th row; `step` > 0.
  std::span<const float> decimated(const rt::DepthFrameHeader& header, std::span<const std::byte> image,
                                   std::uint32_t step);
  /// All points inside a ball.
  std::span<const float> inBall(const rt::DepthFrameHeader& header, std::span<const std::byte> image,
                                const ModelledBall& ball);

 private:
  void updateTable(const rt::DepthFrameHeader& header);

  rt::DepthFrameHeader table_of_ = {};  ///< the header that the table was computed for
  std::vector<double> depth_m_;         ///< by raw value; 0: no point
  std::vector<float> points_;
};

}  // namespace hapticd::drivers
