// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "config/base/error.h"

namespace hapticd::drivers {

/// Size of a frame in pixels.
struct FrameSize {
  int width_px = 0;
  int height_px = 0;
  friend bool operator==(const FrameSize&, const FrameSize&) = default;
};

/// Intrinsics of one mode of a camera, in pixels.
struct Pinhole {
  double fx_px = 0;
  double fy_px = 0;
  double cx_px = 0;
  double cy_px = 0;
};

/// Returns the intrinsics if they can be those of a frame of this size: finite, a field of view between 5 and
/// 160 degrees, square pixels within a tenth, and the optical centre within the frame. `where`: their source,
/// for the error.
base::Result<Pinhole> plausiblePinhole(const Pinhole& pinhole, FrameSize size, std::string_view where);

/// Returns the intrinsics of a frame that shows the same view at another size of the same proportions.
Pinhole scaled(const Pinhole& pinhole, double factor);

}  // namespace hapticd::drivers
