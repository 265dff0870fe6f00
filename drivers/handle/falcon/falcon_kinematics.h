// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include "rt/vec3.h"

namespace hapticd::drivers {

/// Geometry of the Novint Falcon: three legs, each a thigh that a motor turns and a parallelogram of shins to
/// the grip. Positions are in the device's axes, metres: z points out of the device towards the person, x
/// and y as in libnifalcon. Angles are radians.
/// All functions here: Thread: any.  RT: safe.

using FalconCounts = std::array<int, 3>;
using FalconAngles = std::array<double, 3>;

/// The middle of the workspace that other software uses.
inline constexpr rt::Vec3 kFalconCentre_m{0, 0, 0.125};

/// Angles of the thighs from encoder counts, which grow with z.
FalconAngles thighAnglesOf(const FalconCounts& encoder_counts);

/// One leg's three angles: of the thigh, and of the shins in and out of the leg's plane.
struct FalconLeg {
  double thigh_rad = 0;
  double shin_rad = 0;
  double tilt_rad = 0;
};

struct FalconPose {
  rt::Vec3 position_m;
  std::array<FalconLeg, 3> legs;
  /// Row k: the gradient of leg k's thigh angle by the position, rad/m.
  std::array<rt::Vec3, 3> jacobian;
};

/// The legs that hold the grip at `position_m`, and the Jacobian there.
/// Nothing: not finite, out of reach, or so near to a stretched leg that its motor has no grip on it.
std::optional<FalconPose> falconPoseAt(const rt::Vec3& position_m);

/// The pose in which the thighs have these angles, by Newton's method from `start_m`; the pose is within the
/// reach of the device (kFalconReach...).
/// Nothing: there is none, or it was not found within a fixed number of steps.
std::optional<FalconPose> falconPoseOf(const FalconAngles& thighs_rad, const rt::Vec3& start_m);

/// No Falcon's grip comes farther than this from the axis, or leaves this range of z.
inline constexpr double kFalconReachFromAxis_m = 0.08;
inline constexpr double kFalconNearest_m = 0.05;
inline constexpr double kFalconFarthest_m = 0.19;

/// Torques of the three motors, N m, that exert `force_n` at the grip: J^T tau = F.
std::array<double, 3> thighTorquesOf(const FalconPose& pose, const rt::Vec3& force_n);

}  // namespace hapticd::drivers
