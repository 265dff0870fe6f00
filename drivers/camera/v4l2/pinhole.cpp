// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/v4l2/pinhole.h"

#include <fmt/format.h>

#include <cmath>
#include <string>

namespace hapticd::drivers {
namespace {

constexpr const char* kRemedy =
    "set camera.intrinsics to configured, and camera.fx_px, camera.fy_px, camera.cx_px and camera.cy_px to "
    "the "
    "values of a calibration of this mode";

// tan() of half of 5 and 160 degrees
constexpr double kNarrowest = 0.0437;
constexpr double kWidest = 5.67;

bool isPlausibleView(double focal_px, int extent_px) {
  const double half_view = extent_px / (2 * focal_px);
  return std::isfinite(focal_px) && focal_px > 0 && half_view >= kNarrowest && half_view <= kWidest;
}

bool isWithin(double centre_px, int extent_px) {
  return std::isfinite(centre_px) && centre_px > 0 && centre_px < extent_px;
}

}  // namespace

base::Result<Pinhole> plausiblePinhole(const Pinhole& pinhole, FrameSize size, std::string_view where) {
  const auto refuse = [&](std::string what) {
    return std::unexpected(base::Error{std::string(where), std::move(what), kRemedy});
  };
  if (!isPlausibleView(pinhole.fx_px, size.width_px) || !(pinhole.fy_px > 0)) {
    return refuse(fmt::format("the focal length ({}, {}) px is not that of a frame of {} x {} pixels",
                              pinhole.fx_px, pinhole.fy_px, size.width_px, size.height_px));
  }
  if (!(std::abs(pinhole.fx_px / pinhole.fy_px - 1) < 0.1)) {
    return refuse(fmt::format("the focal lengths {} and {} px differ by more than a tenth", pinhole.fx_px,
                              pinhole.fy_px));
  }
  if (!isWithin(pinhole.cx_px, size.width_px) || !isWithin(pinhole.cy_px, size.height_px)) {
    return refuse(fmt::format("the optical centre ({}, {}) lies outside the frame of {} x {} pixels",
                              pinhole.cx_px, pinhole.cy_px, size.width_px, size.height_px));
  }
  return pinhole;
}

Pinhole scaled(const Pinhole& pinhole, double factor) {
  // the centre of the first pixel is at 0, its edge at -0.5
  return {pinhole.fx_px * factor, pinhole.fy_px * factor, (pinhole.cx_px + 0.5) * factor - 0.5,
          (pinhole.cy_px + 0.5) * factor - 0.5};
}

}  // namespace hapticd::drivers
