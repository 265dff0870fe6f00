// SPDX-License-Identifier: Apache-2.0
#include "config/settings/depth_cameras.h"

#include <cmath>
#include <numbers>

namespace hapticd::config {
namespace {

/// Subpixel error of a RealSense D400 on a surface with texture, as its vendor states it (librealsense, issue
/// 3904).
constexpr double kSubpixel_px = 0.08;
/// Assumed, because nothing is published: the side of a window that stereo matching may use, and the shares
/// of what stands still. That it is there is known of stereo, as a pattern that hardly changes with the
/// distance (librealsense, issue 3210), and of time of flight, as deviations of single pixels.
constexpr double kStereoWindow_px = 5;
constexpr double kStereoStanding = 0.5;
constexpr double kFlightStanding = 0.3;
/// Focal length of a Femto Mega by the vendor's public source, 374.185 px for 640 columns.
constexpr double kFlightFocalPerWidth = 0.585;
/// Of the size that is published for cameras of the same sensor: about 2 mm at 1 m.
constexpr double kFlightC0_m = 0.0005;
constexpr double kFlightC1 = 0.0015;

rt::DepthModelParameters depthCamera(FrameSize size, double focal_px) {
  rt::DepthModelParameters camera;
  camera.width_px = size.width_px;
  camera.height_px = size.height_px;
  camera.fx_px = camera.fy_px = focal_px;
  camera.cx_px = 0.5 * size.width_px - 0.5;
  camera.cy_px = 0.5 * size.height_px - 0.5;
  camera.law = rt::DepthLawKind::linear;
  camera.unit_m = 0.001;
  camera.raw_no_measurement = 0;
  camera.raw_values = 65536;
  return camera;
}

}  // namespace

double stereoNoise_per_m(double focal_px, double baseline_m) {
  return kSubpixel_px / (focal_px * baseline_m);
}

rt::DepthModelParameters stereoCamera(FrameSize size, double field_of_view_deg, double baseline_m) {
  const double half_rad = 0.5 * field_of_view_deg * std::numbers::pi / 180;
  rt::DepthModelParameters camera = depthCamera(size, 0.5 * size.width_px / std::tan(half_rad));
  camera.principle = rt::DepthPrinciple::active_stereo;
  camera.noise = {.c2_per_m = stereoNoise_per_m(camera.fx_px, baseline_m),
                  .standing_share = kStereoStanding,
                  .correlation_px = kStereoWindow_px};
  return camera;
}

rt::DepthModelParameters timeOfFlightCamera(FrameSize size) {
  rt::DepthModelParameters camera = depthCamera(size, kFlightFocalPerWidth * size.width_px);
  camera.principle = rt::DepthPrinciple::time_of_flight;
  camera.noise = {
      .c0_m = kFlightC0_m, .c1 = kFlightC1, .standing_share = kFlightStanding, .correlation_px = 1};
  return camera;
}

}  // namespace hapticd::config
