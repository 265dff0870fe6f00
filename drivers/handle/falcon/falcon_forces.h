// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/handle/falcon/falcon_kinematics.h"
#include "drivers/handle/falcon/falcon_packet.h"
#include "rt/vec3.h"

namespace hapticd::drivers {

/// Motor command for a force.
struct FalconForce {
  FalconCounts motor_counts{};
  double exerted_share = 1;  ///< fraction of the requested force; below 1: a motor is at its limit
};

/// Returns the motor counts for a force at the grip in newtons, in the device's axes: -10000 counts per N m,
/// times `force_share` (0..1). If a motor would exceed its limit, all three are scaled alike, so that the
/// direction of the force is preserved. A force that is not finite counts as zero.
/// RT: safe.
FalconForce motorCountsFor(const FalconPose& pose, const rt::Vec3& force_n, double force_share);

}  // namespace hapticd::drivers
