// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/depth_frame.h"

namespace hapticd::rt {

/// A view of one image of raw disparities (kRawValues), in frame layout. A Kinect v1 delivers them; the depth
/// of other cameras is converted by DisparityImage. Only requested pixels are valid.
struct DisparityFrame {
  const std::uint16_t* raw;
  std::uint64_t sequence;   ///< see DepthFrame
  std::int64_t arrival_ns;  ///< see DepthFrame

  /// A frame of a camera whose raw values are raw disparities.
  DisparityFrame(const DepthFrame& frame) noexcept  // NOLINT(google-explicit-constructor): they are the same
      : DisparityFrame(frame.raw, frame) {}
  /// `disparity` belongs to `frame`.
  DisparityFrame(const std::uint16_t* disparity, const DepthFrame& frame) noexcept
      : raw(disparity), sequence(frame.sequence), arrival_ns(frame.arrival_ns) {}
};

}  // namespace hapticd::rt
