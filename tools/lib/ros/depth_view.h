// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "rt/depth/depth_frame_header.h"
#include "tools/lib/ros/contents.h"

namespace hapticd::tools::ros {

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

  /// x, y and z of each measured pixel in metres, row by row; what was in `xyz_m` is replaced.
  void points(std::vector<float>& xyz_m) const;
  /// The image in millimetres, rounded; 0: no measurement.
  void millimetres(DepthImage& picture) const;
  PinholeCamera camera() const;
  /// When the frame was measured: the middle of the exposure where the camera tells it, else when it had
  /// arrived; CLOCK_MONOTONIC.
  std::int64_t time_ns() const;

 private:
  /// Of the columns of a row; the memory need not be aligned.
  std::uint16_t rawAt(std::size_t row, std::size_t column) const;
  void tabulate();

  /// What decides about depths.
  struct Law {
    rt::DepthLawKind kind{};
    std::array<double, 2> coefficients{};
    std::uint32_t raw_no_measurement = 0;
    friend bool operator==(const Law&, const Law&) = default;
  };

  const rt::DepthFrameHeader* header_ = nullptr;
  std::span<const std::byte> image_;
  std::optional<Law> law_;               // of the tables
  std::vector<float> depth_m_;           // by raw value; 0: no measurement
  std::vector<std::uint16_t> depth_mm_;  // likewise
  std::vector<float> column_slope_;      // x / z of each column
};

}  // namespace hapticd::tools::ros
