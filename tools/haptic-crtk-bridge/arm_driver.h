// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "tools/haptic-crtk-bridge/arm_delay.h"
#include "tools/haptic-crtk-bridge/arm_topics.h"
#include "tools/haptic-crtk-bridge/pose_gate.h"
#include "tools/lib/device/device_session.h"
#include "tools/lib/device/threaded_device.h"

namespace hapticd::tools::crtk {

/// Drives an arm that speaks CRTK over DDS. No wrench has an end of its own there, so each session ends with
/// wrenches of zero that the arm has acknowledged, or with words that it has not.
/// Thread: one.
class ArmDriver final : public DeviceDriver {
 public:
  static constexpr std::int64_t kTick_ns = 1'000'000;
  /// What CRTK knows no limit for; what a person bears is limited by the bridge.
  static constexpr double kMostForce_n = 100;

  ArmDriver(ArmTopics topics, ArmOptions options);

  base::Result<void> drive(DeviceSession& session) override;

 private:
  base::Result<void> await(DeviceSession& session);
  std::optional<base::Error> missing(std::int64_t now_ns) const;
  base::Result<void> follow(DeviceSession& session);
  void hear(DeviceSession& session, std::int64_t until_ns);
  void take(DeviceSession& session);
  void judge(const MeasuredPose& pose, std::int64_t now_ns);
  void publish(DeviceSession& session, std::int64_t now_ns);
  void exert(DeviceSession& session, std::int64_t now_ns);
  void send(const rt::Vec3& force_n_in_frame);
  void letGo(DeviceSession& session);
  void complain(DeviceSession& session);
  bool mayExert() const { return state_ && state_->state == "ENABLED" && state_->is_homed; }

  ArmTopics topics_;
  ArmOptions options_;
  PoseGate gate_;
  ArmDelay delay_;
  std::optional<ArmState> state_;
  std::optional<MeasuredPose> pose_;  // the newest accepted one
  std::int64_t pose_ns_ = 0;          // when it came
  bool pose_is_new_ = false;
  std::optional<double> gripper_rad_;
  std::int64_t gripper_ns_ = 0;
  std::optional<base::Error> ending_;  // why the session has to end
  std::int64_t send_until_ns_ = 0;
  std::int64_t next_look_ns_ = 0;
  std::uint64_t unsent_ = 0;
  PoseFault fault_ = PoseFault::none;  // since the last look, as are the next two
  bool jumped_ = false;
  bool was_stale_ = false;
  Complaint of_fault_;
  Complaint of_jump_;
  Complaint of_stale_;
  Complaint of_clock_;
  Complaint of_unsent_;
};

}  // namespace hapticd::tools::crtk
