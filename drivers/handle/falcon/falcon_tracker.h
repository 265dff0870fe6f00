// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "drivers/handle/falcon/falcon_kinematics.h"
#include "drivers/handle/falcon/falcon_packet.h"
#include "rt/vec3.h"

namespace hapticd::drivers {

/// What is known of one Falcon from its replies: whether its encoders are homed, and where the grip is. The
/// encoders count from wherever they were switched on until the grip has been at both ends; without that a
/// position means nothing and no force is exerted.
/// Thread: one.  RT: safe.
class FalconTracker {
 public:
  /// So many replies in a row must agree before homing is believed to be done, or undone.
  static constexpr int kSteadyReplies = 10;

  /// `force_share`: as of motorCountsFor().
  explicit FalconTracker(double force_share) : force_share_(force_share) {}

  void take(const FalconReply& reply);

  bool homed() const { return homed_; }
  /// The newest reply's; nothing while not homed, and where the encoders name no place in the device's reach.
  const std::optional<FalconPose>& pose() const { return pose_; }

  /// What to send next. `force_n`: in the device's axes; nothing: nobody commands, and no force is exerted.
  FalconOrder orderFor(const std::optional<rt::Vec3>& force_n);
  /// A motor was at its limit in the newest order.
  bool forceCut() const { return force_cut_; }

 private:
  void takeHoming(std::uint8_t homed_encoders);

  double force_share_;
  bool homed_ = false;
  int contrary_replies_ = 0;  // in a row
  std::optional<FalconPose> pose_;
  rt::Vec3 last_position_m_ = kFalconCentre_m;  // where the search for the next pose begins
  bool force_cut_ = false;
};

}  // namespace hapticd::drivers
