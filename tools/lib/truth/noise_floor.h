// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "drivers/camera/synthetic/sensor_noise.h"
#include "rt/base/parameters.h"

namespace hapticd::tools {

/// The model that is fitted to a patch of depth.
enum class FloorModel : std::uint8_t {
  plane,      ///< offset and tilt are unknown
  quadratic,  ///< offset, tilt and curvature are unknown
};

/// A square patch of a surface that faces the camera.
struct FloorPatch {
  double side_m = 0.04;
  double distance_m = 1;
  int frames = 8;
  /// The surface moves by one raw unit from frame to frame, with a known velocity: the static
  /// component decays by NoisePattern::staticCorrelation().
  bool moving = false;
  FloorModel model = FloorModel::plane;
};

/// Smallest RMS error of a force at the middle of a patch that an unbiased estimate can have.
struct FloorError {
  double depth_m = 0;       ///< of the surface's depth
  double slope = 0;         ///< of the surface's tilt along one axis of the patch, metres per metre
  double force_n = 0;       ///< of the force along the normal
  double force_jnd = 0;     ///< the same in just noticeable differences, kForceJnd_n
  double tilt_force_n = 0;  ///< of the force in one direction along the surface, by the error of the tilt
  int side_px = 0;          ///< pixels along the patch's side
  bool determined = false;  ///< false: too few pixels for the model; all errors are infinite
};

/// 7 % of the 4 N at which the floor is stated: the smallest difference between forces that people notice.
inline constexpr double kForceJnd_n = 0.28;
/// How deep the HIP is in the surface where the floor of the force along the surface is stated, metres.
inline constexpr double kFloorPenetration_m = 0.008;

/// Generalised least squares with the noise's own covariance in space and time (Gauss-Markov): the static,
/// the drifting and the fast part are correlated over the matching window; rounding adds 1/12 raw unit^2,
/// independent between pixels and, as far as the noise moves a value over a step, between frames. The
/// camera's distortion (coarse_raw) is not known to the estimate; what it adds to the error is in the
/// figures. `stiffness_n_per_m` turns depth into force.
FloorError noiseFloor(const drivers::SensorNoise::Parameters& noise, const rt::DepthModelParameters& camera,
                      const FloorPatch& patch, double stiffness_n_per_m);

}  // namespace hapticd::tools
