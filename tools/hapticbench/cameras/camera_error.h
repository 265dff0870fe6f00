// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tools/hapticbench/requirement.h"
#include "tools/hapticbench/statistics.h"

namespace hapticd::tools {

/// Errors of a law on surfaces that a camera sees with its own noise: the HIP is pushed 5 to 20 mm into a
/// plane that faces the camera, one turned by 30 degrees and a ball of 100 mm, and the force is compared with
/// that of a spring to the true surface. All of the noise stands still, which no law can average away.
struct CameraError {
  std::string camera;
  double distance_m = 0;
  std::string law;
  double sigma_m = 0;     ///< standard deviation of Z of a pixel there, rounding included
  Spread plane_m;         ///< error of the force over the stiffness, on both planes
  Spread ball_m;          ///< the same on the ball
  double expected_m = 0;  ///< RMS error that `auto` expects of that noise (config/measured_laws.inc)

  double planeSigmas() const { return plane_m.rms() / sigma_m; }
  double ballSigmas() const { return ball_m.rms() / sigma_m; }
  double rms_m() const;
  /// RMS error over the one that `auto` expects.
  double byExpected() const { return rms_m() / expected_m; }
};

/// Error on small things near a camera of a baseline of 18 mm (RealSense D405), in just noticeable
/// differences: 8 mm deep in a plane and 2 mm in a ball of 20 mm.
struct NearError {
  std::string scene;
  double distance_m = 0;
  Spread error_jnd;
};

struct CameraErrors {
  std::vector<CameraError> rows;
  std::vector<NearError> near;
};

/// Measures all laws with each camera at distances in its range. `frames`: of each camera and scene, each
/// with another noise.
CameraErrors measureCameraErrors(int frames, const std::function<void(const std::string&)>& progress = {});

/// The requirements: no camera errs more in its own standard deviations than a Kinect v1 does under the law
/// `surface`, and small things near a camera are displayed to within one JND.
std::vector<Requirement> requirementsOf(const CameraErrors& errors);

}  // namespace hapticd::tools
