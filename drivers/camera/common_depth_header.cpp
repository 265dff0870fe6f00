// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/common_depth_header.h"

#include <algorithm>
#include <cmath>

#include "rt/base/pose.h"

namespace hapticd::drivers {
namespace {

/// Frequency of the Kinect v1's own counter.
constexpr std::uint64_t kDeviceTick_hz = 60'000'000;
/// Standard deviation of a raw disparity (Khoshelham and Elberink 2012).
constexpr double kNoise_raw = 0.5;

std::string_view serialOf(const config::CameraSettings& camera, std::string_view identity) {
  constexpr std::string_view kDriver = "freenect ";
  if (!camera.serial.empty()) return camera.serial;
  return identity.starts_with(kDriver) ? identity.substr(kDriver.size()) : std::string_view{};
}

}  // namespace

rt::DepthFrameHeader commonDepthHeader(const config::CameraSettings& camera, std::string_view identity) {
  const rt::DepthModelParameters model = camera.effectiveDepthModel();
  rt::DepthFrameHeader header;
  header.depth_law = rt::DepthLawKind::reciprocal;
  header.depth_law_coefficients = {model.a_per_m, model.b_per_m};
  header.fx_px = model.fx_px;
  header.fy_px = model.fy_px;
  header.cx_px = model.cx_px;
  header.cy_px = model.cy_px;
  header.rotation_world_camera = rt::rotationOf(camera.pose());
  const rt::Vec3 position = camera.pose().position_m;
  header.position_m_in_world = {position.x, position.y, position.z};
  header.noise = rt::DepthNoiseKind::polynomial;
  // DZ = a Z^2 draw, with draw the deviation of the raw disparity.
  header.noise_coefficients = {0, 0, std::abs(model.a_per_m) * kNoise_raw};
  header.device_tick_hz = kDeviceTick_hz;
  const std::string_view serial = serialOf(camera, identity).substr(0, header.serial.size() - 1);
  std::ranges::copy(serial, header.serial.begin());
  return header;
}

}  // namespace hapticd::drivers
