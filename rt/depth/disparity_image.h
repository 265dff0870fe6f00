// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "rt/depth/depth_frame.h"
#include "rt/depth/depth_model.h"

namespace hapticd::rt {

/// Raw disparities, in which surfaces are modelled, have at most 13 bits: 1/Z is linear in them, so a plane
/// in space is a plane in the image. Of a camera those up to DisparityScale::last_raw are measurements.
inline constexpr int kRawDisparities = 8192;
/// Where the core writes raw disparities, this one means that there is no measurement.
inline constexpr std::uint16_t kNoRawDisparity = kRawDisparities - 1;

/// A view of one image of raw disparities, in frame layout. A Kinect v1 delivers them; the depth of other
/// cameras is converted by DisparityImage. Only requested pixels are valid.
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

/// Converts the frames of a camera to raw disparities, the requested pixels only. Nothing is copied if the
/// camera's raw values are raw disparities.
/// Thread: one (the scene thread).  RT: allocates nothing after construction; cost per requested pixel.
class DisparityImage {
 public:
  /// `model` outlives the image.  RT: not safe (allocates).
  explicit DisparityImage(const DepthModel& model);

  /// Returns a frame as raw disparities. None of its pixels is valid before convert(), unless the camera's
  /// raw values are raw disparities.
  DisparityFrame of(const DepthFrame& frame) const noexcept;
  /// Makes the rows of a window valid, whole tiles of kRowAlignment_px columns.
  void convert(const DepthFrame& frame, const PixelWindow& window) noexcept;

 private:
  const DepthModel& model_;
  std::size_t size_;  // 0 if raw values are raw disparities
  std::unique_ptr<std::uint16_t[]> disparity_;
};

}  // namespace hapticd::rt
