// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "rt/depth/depth_frame.h"
#include "rt/depth/depth_model.h"
#include "rt/depth/disparity_frame.h"

namespace hapticd::rt {

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
