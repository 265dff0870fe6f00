// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "daemon/trace/ros/message_set.h"
#include "rt/base/vec3.h"
#include "rt/depth/depth_frame_header.h"

namespace hapticd::trace::ros {

/// The ball around which the scene is modelled.
struct ModelledBall {
  rt::Vec3 centre_m_in_world;
  double radius_m = 0;  ///< 0: none, or the whole frame is modelled
};

/// A depth frame of hapticd as ROS 2 sees it, in the optical frame of the camera: x right, y down, z forward.
/// A pixel counts as measured where its raw value stands for a depth in front of the camera, up to
/// kFarthest_m; the nearest and farthest depth that hapticd's forces heed are not applied. Thread: one at a
/// time.  RT: not safe.
class DepthView {
 public:
  /// Farther values are no measurements but next to the pole of a reciprocal depth law.
  static constexpr double kFarthest_m = 20;

  /// Header and image stay valid while the view is used; the header has no fault, and the image has its size.
  void set(const rt::DepthFrameHeader& header, std::span<const std::byte> image);

  // x, y and z of measured pixels in metres, row by row; what was in `xyz_m` is replaced.
  /// Of every `step`-th pixel of every `step`-th row; `step` > 0.
  void points(std::vector<float>& xyz_m, std::uint32_t step = 1) const;
  /// Of all inside a ball.
  void pointsInBall(const ModelledBall& ball, std::vector<float>& xyz_m) const;
  /// The image in millimetres, rounded; 0: no measurement.
  void millimetres(DepthImage& picture) const;
  PinholeCamera camera() const;
  /// When the frame was measured: the middle of the exposure where the camera tells it, else when it had
  /// arrived; CLOCK_MONOTONIC.
  std::int64_t time_ns() const;

 private:
  /// What the tables are made of.
  struct Law {
    rt::DepthLawKind kind;
    std::array<double, 2> coefficients;
    std::uint32_t raw_no_measurement;
    friend bool operator==(const Law&, const Law&) = default;
  };

  void tabulate();
  std::uint16_t rawAt(std::size_t row, std::size_t column) const;

  const rt::DepthFrameHeader* header_ = nullptr;
  std::span<const std::byte> image_;
  std::optional<Law> law_;
  std::vector<double> depth_m_;  // by raw value; 0: no measurement
  std::vector<std::uint16_t> depth_mm_;
  std::vector<float> column_slope_;  // x by z of each column
};

}  // namespace hapticd::trace::ros
