// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "drivers/camera/camera.h"
#include "tools/lib/depth_noise/depth_noise.h"

namespace hapticd::tools {

/// What a camera delivered in some seconds.
struct CameraTest {
  drivers::CameraStatus status;
  std::uint64_t frames = 0;
  double rate_hz = 0;             ///< mean over the arrivals; NaN with fewer than two frames
  std::uint64_t lost_frames = 0;  ///< by the gaps in the camera's own count
  DepthNoiseReport noise;         ///< of as many frames as there was time for
  rt::DepthModelParameters model;
  std::vector<double> mean_depth_m;  ///< row by row without padding; 0: a hole
};

/// Streams from a camera that nothing else uses, which must look at a resting scene. Returns after `duration`
/// from its first frame.
/// Errors: no frame within `patience`, or the driver cannot use the camera; the error has its reason.
base::Result<CameraTest> testCamera(drivers::Camera& camera, std::chrono::milliseconds duration,
                                    std::chrono::milliseconds patience);

/// The result for people, and the lines for the configuration.
std::string textOf(const CameraTest& test);

/// The result for programs.
std::string jsonOf(const CameraTest& test);

}  // namespace hapticd::tools
