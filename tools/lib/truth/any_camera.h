// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "rt/depth_frame.h"
#include "rt/parameters.h"

namespace hapticd::tools {

/// A depth camera with its usual name, as a driver would describe it.
struct NamedCamera {
  std::string name;
  rt::DepthModelParameters camera;
};

/// A stereo camera that delivers depth: f from the field of view, noise Z^2 s / (f b) with s = 0.08 px.
rt::DepthModelParameters stereoCamera(int width_px, int height_px, double field_of_view_deg,
                                      double baseline_m, double unit_m, double near_m, double far_m);
/// A time-of-flight camera that delivers depth in millimetres; its noise grows linearly.
rt::DepthModelParameters timeOfFlightCamera(int width_px, int height_px);
/// A Kinect v1 with the noise of its raw disparity, which the core does not need to be given.
rt::DepthModelParameters kinectWithNoise();

/// Depth in metres along the optical axis at a pixel; 0: nothing is measured.
using DepthAt = std::function<double(double column, double row)>;

/// Depth of a plane through (0, 0, -distance), tilted about the camera's x axis.
DepthAt tiltedPlane(const rt::DepthModelParameters& camera, double distance_m, double tilt_rad);
/// Depth of the front of a ball around `centre_m_in_camera`, and nothing beside it.
DepthAt ball(const rt::DepthModelParameters& camera, const rt::Vec3& centre_m_in_camera, double radius_m);

/// A frame of the camera. `seed`: of noise by the camera's own model, alike over boxes of correlation_px
/// pixels; 0: no noise, only rounding to raw values.
std::unique_ptr<rt::DepthFrame> frameOf(const rt::DepthModelParameters& camera, const DepthAt& depth,
                                        std::uint32_t seed = 0);

}  // namespace hapticd::tools
