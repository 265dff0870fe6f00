// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>
#include <optional>

#include "drivers/camera/synthetic/sensor_noise.h"
#include "rt/base/parameters.h"
#include "rt/base/vec3.h"

namespace hapticd::tools {

/// How long the estimate looks at the surface.
struct FloorFrames {
  int count = 8;
  /// The surface moves by one raw unit from frame to frame, with a known velocity: the static
  /// component decays by NoisePattern::staticCorrelation().
  bool moving = false;
};

/// A square patch of a plane that faces the camera; offset and tilt are unknown.
struct FloorPatch {
  double side_m = 0.04;
  double distance_m = 1;
  /// How far from the middle of the patch the force acts, along one axis: 0 in the middle, 1 on its edge.
  double off_centre = 0;
  FloorFrames frames{};
};

/// A ball or an endless rod that the camera sees in perspective, and a force on it. Camera frame, which looks
/// along -z. Unknown are the ball's centre and radius (4), or the rod's axis and radius (5).
struct FloorBody {
  rt::Vec3 contact_m{};            ///< on the surface, visible, where the force acts
  rt::Vec3 outward{};              ///< unit normal there
  double radius_m = 0.05;          ///< convex
  std::optional<rt::Vec3> axis{};  ///< unit vector along the rod, across `outward`; nothing: a ball
  rt::Vec3 along{};                ///< unit vector across `outward`, of tilt_force_n; zero: not computed
  double depth_m = 0.008;          ///< of the HIP, for tilt_force_n; less than the radius
  double window_m = 0.16;          ///< diameter of the neighbourhood of the contact that the estimate uses
  double rod_length_m = 0.08;      ///< and how much of a rod's length: so far it is taken to be straight
  /// Pixels where the surface is seen at a larger angle from its normal are not used: at the outline a sensor
  /// mixes body and background. Up to this angle neighbours of a Kinect's image differ, from 0.6 m on, by
  /// less than the SensorNoise::kEdgeJumpRaw at which they begin to be missing.
  double max_incidence_rad = 70 * std::numbers::pi / 180;
  FloorFrames frames{};
};

/// Smallest RMS error of a force that an unbiased estimate can have.
struct FloorError {
  double depth_m = 0;       ///< of the surface: a patch's depth, a body's position along the normal
  double slope = 0;         ///< of a patch's tilt along one axis, metres per metre; 0 for a body
  double force_n = 0;       ///< of the force along the normal
  double force_jnd = 0;     ///< the same in just noticeable differences, kForceJnd_n
  double tilt_force_n = 0;  ///< of the force in one direction along the surface, by the error of its normal
  int pixels = 0;           ///< that the estimate uses
  bool determined = false;  ///< false: too few pixels for the model; all errors are infinite
};

/// 7 % of the 4 N at which the floor is stated: the smallest difference between forces that people notice.
inline constexpr double kForceJnd_n = 0.28;
/// How deep the HIP is in a patch where the floor of the force along the surface is stated, metres.
inline constexpr double kFloorPenetration_m = 0.008;

/// Generalised least squares with the noise's own covariance in space and time (Gauss-Markov; for a body,
/// whose depth is not linear in what is unknown, the Cramer-Rao bound): the static, the drifting and the fast
/// part are correlated over the matching window; rounding adds 1/12 raw unit^2, independent between pixels
/// and, as far as the noise moves a value over a step, between frames. The camera's distortion (coarse_raw)
/// is not known to the estimate; what it adds to the error is in the figures. `stiffness_n_per_m` turns depth
/// into force. `camera`: of raw disparity.  Thread: any.  RT: not safe.
FloorError noiseFloor(const drivers::SensorNoise::Parameters& noise, const rt::DepthModelParameters& camera,
                      const FloorPatch& patch, double stiffness_n_per_m);
FloorError noiseFloor(const drivers::SensorNoise::Parameters& noise, const rt::DepthModelParameters& camera,
                      const FloorBody& body, double stiffness_n_per_m);

}  // namespace hapticd::tools
