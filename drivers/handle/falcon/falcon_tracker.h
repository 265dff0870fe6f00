// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "drivers/handle/falcon/falcon_kinematics.h"
#include "drivers/handle/falcon/falcon_packet.h"
#include "rt/base/vec3.h"

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

/// State of a Falcon derived from its replies: whether its encoders are homed, and the position of the grip.
/// The encoders count from their position at power-up until the grip has been at both ends; before that a
/// position is meaningless and no force is exerted.
/// Thread: one.  RT: safe.
class FalconTracker {
 public:
  /// Number of consecutive replies that must agree before homing counts as done or lost.
  static constexpr int kSteadyReplies = 10;

  /// `force_share`: see motorCountsFor().
  explicit FalconTracker(double force_share) : force_share_(force_share) {}

  /// Processes a reply.
  void take(const FalconReply& reply);

  bool homed() const { return homed_; }
  /// Returns the pose of the newest reply; nothing while not homed or if the encoders report a position out
  /// of reach.
  const std::optional<FalconPose>& pose() const { return pose_; }

  /// Returns the next order. `force_n`: in the device's axes; nothing: no command, so no force is exerted.
  FalconOrder orderFor(const std::optional<rt::Vec3>& force_n);
  /// Returns whether a motor was at its limit in the newest order.
  bool forceCut() const { return force_cut_; }

 private:
  void takeHoming(std::uint8_t homed_encoders);

  double force_share_;
  bool homed_ = false;
  int contrary_replies_ = 0;  // number of consecutive ones
  std::optional<FalconPose> pose_;
  rt::Vec3 last_position_m_ = kFalconCentre_m;  // start of the search for the next pose
  bool force_cut_ = false;
};

}  // namespace hapticd::drivers
