// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include "rt/base/vec3.h"

namespace hapticd::drivers {

/// Kinematics of the Novint Falcon: three legs, each with a motor-driven thigh and a parallelogram of shins
/// that holds the grip. Positions are in metres along the device's axes: z points out of the device towards
/// the person, x and y as in libnifalcon. Angles are in radians.
/// All functions:  Thread: any.  RT: safe.

using FalconCounts = std::array<int, 3>;
using FalconAngles = std::array<double, 3>;

/// Middle of the workspace used by other software.
inline constexpr rt::Vec3 kFalconCentre_m{0, 0, 0.125};

/// Converts encoder counts, which increase with z, to the angles of the thighs.
FalconAngles thighAnglesOf(const FalconCounts& encoder_counts);

/// The three angles of one leg: of the thigh, and of the shins within and out of the leg's plane.
struct FalconLeg {
  double thigh_rad = 0;
  double shin_rad = 0;
  double tilt_rad = 0;
};

/// Position of the grip with the corresponding legs and Jacobian.
struct FalconPose {
  rt::Vec3 position_m;
  std::array<FalconLeg, 3> legs;
  /// Row k: gradient of leg k's thigh angle with respect to the position, rad/m.
  std::array<rt::Vec3, 3> jacobian;
};

/// Returns the pose in which the grip is at `position_m`.
/// Nothing: not finite, out of reach, or so close to a stretched leg that its motor has no leverage.
std::optional<FalconPose> falconPoseAt(const rt::Vec3& position_m);

/// Returns the pose with these thigh angles, found by Newton's method from `start_m` and within the reach of
/// the device (kFalconReach...).
/// Nothing: there is none, or it was not found within a fixed number of steps.
std::optional<FalconPose> falconPoseOf(const FalconAngles& thighs_rad, const rt::Vec3& start_m);

/// No Falcon's grip gets farther from the axis than this or leaves this range of z.
inline constexpr double kFalconReachFromAxis_m = 0.08;
inline constexpr double kFalconNearest_m = 0.05;
inline constexpr double kFalconFarthest_m = 0.19;

/// Returns the torques of the three motors in N m that exert `force_n` at the grip: J^T tau = F.
std::array<double, 3> thighTorquesOf(const FalconPose& pose, const rt::Vec3& force_n);

}  // namespace hapticd::drivers
