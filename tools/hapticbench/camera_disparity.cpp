// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/camera_disparity.h"

#include <cmath>
#include <limits>

#include "tools/lib/depth_noise/depth_noise.h"

namespace hapticd::tools {

CameraDisparity::CameraDisparity(const rt::DepthModelParameters& camera)
    : model_(camera, {}),
      of_raw_(std::numeric_limits<std::uint16_t>::max() + std::size_t{1},
              std::numeric_limits<float>::quiet_NaN()) {
  for (std::uint32_t value = 0; value < camera.raw_values; ++value) {
    const auto raw = static_cast<std::uint16_t>(value);
    if (!model_.isMeasurement(raw)) continue;
    if (model_.rawIsDisparity()) {
      of_raw_[raw] = raw;
    } else if (const double depth_m = model_.depthOfReal_m(raw); depth_m > 0) {
      of_raw_[raw] = static_cast<float>(ofDepth(depth_m));
    }
  }
}

rt::Vec3 CameraDisparity::pointOf(double column, double row, double disparity) const {
  const rt::DepthModelParameters& camera = model_.parameters();
  const double depth = depth_m(disparity);
  return {depth * (column - camera.cx_px) / camera.fx_px, -depth * (row - camera.cy_px) / camera.fy_px,
          -depth};
}

double CameraDisparity::changingNoise(double disparity) const {
  const rt::DepthNoiseParameters& noise = model_.parameters().noise;
  const double depth = depth_m(disparity);
  if (!noise.isKnown() || !(depth > 0)) return 0;
  return std::sqrt(1 - noise.standing_share) * noise.sigma_m(depth) / unit_m(depth);
}

rt::DepthModelParameters cameraWithNoise(const BenchSequence& sequence) {
  rt::DepthModelParameters camera = sequence.camera();
  if (camera.noise.isKnown() || isKinect(camera)) return camera;
  DepthNoise measured;
  for (const auto& frame : sequence.frames) measured.add(*frame);
  const DepthNoiseReport report = measured.report();
  if (const auto noise = fittedNoise(report.at_depths, camera.principle)) {
    camera.noise = *noise;
    camera.noise.correlation_px = report.correlation_px;
  }
  return camera;
}

}  // namespace hapticd::tools
