// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "config/base/error.h"
#include "tools/haptic-crtk-bridge/arm_measurement.h"
#include "tools/hapticd-ros/dds/participant.h"
#include "tools/hapticd-ros/dds/publisher.h"
#include "tools/hapticd-ros/dds/subscription.h"
#include "tools/lib/device/threaded_device.h"

namespace hapticd::tools::crtk {

struct ArmOptions {
  std::string arm;    ///< namespace, "MTMR"
  std::string frame;  ///< that its measurements must have; empty: that of the first one
  WrenchConvention convention = WrenchConvention::body_absolute;
  bool gravity_compensation = false;  ///< turn it on
};

/// A message of operating_state.
struct ArmState {
  std::string state;  ///< ENABLED, DISABLED, PAUSED, FAULT
  bool is_homed = false;
  friend bool operator==(const ArmState&, const ArmState&) = default;
};

/// The topics of an arm, under the names of CRTK and dVRK. Thread: one at a time.  RT: not safe.
class ArmTopics {
 public:
  static base::Result<ArmTopics> open(const ros::Network& network, const ArmOptions& options);

  /// Returns when messages have come, or at the end of the time.
  void wait(std::chrono::nanoseconds at_most) { wait_.wait(at_most); }
  /// Calls take(pose) for what has been measured since the last call, oldest first.
  void takePoses(const std::function<void(const MeasuredPose&)>& take);
  /// The newest state since the last call.
  std::optional<ArmState> takeState();
  /// The newest opening of the gripper since the last call, rad.
  std::optional<double> takeGripper();
  /// Whether another program has set the axes of wrenches to others than these options want since the last
  /// call.
  bool takeContrarySetting();

  /// Sends the settings that the options want, and waits until the arm has them; false: it has not.
  bool sendSettings();
  /// `frame`: of the measurements. Returns false where it could not be sent.
  bool sendWrench(const std::string& frame, std::int64_t utc_ns, const Wrench& wrench);
  /// Whether the arm has got all wrenches.
  bool wrenchesArrived(std::chrono::nanoseconds at_most) const {
    return ends_.wrenches.isAcknowledged(at_most);
  }

  /// What is not as it has to be in the network; nothing: all is.
  std::optional<base::Error> problem() const;

 private:
  struct Ends {
    ros::Subscription poses;
    ros::Subscription states;
    ros::Subscription last_states;  // of arms that keep their state for those who come later
    ros::Subscription grippers;
    ros::Subscription settings_seen;
    ros::Subscription wrenches_seen;  // for their publishers alone; nothing is taken
    ros::Publisher wrenches;
    ros::Publisher absolute;
    ros::Publisher gravity;
  };
  ArmTopics(ros::Participant participant, ArmOptions options, const Ends& ends);

  bool wantsAbsolute() const { return options_.convention == WrenchConvention::body_absolute; }
  /// Whether the axes of forces are what body/set_cf_orientation_absolute says.
  bool setsAxes() const { return wantsAbsolute() || options_.convention == WrenchConvention::body; }

  ros::Participant participant_;
  ArmOptions options_;
  Ends ends_;
  ros::MessageWait wait_;
};

/// The topic of the measurements and of the wrenches of an arm.
std::string poseTopicOf(const ArmOptions& options);
std::string wrenchTopicOf(const ArmOptions& options);

/// Drives an arm that speaks CRTK over DDS. No wrench has an end of its own there, so each session ends with
/// wrenches of zero that the arm has acknowledged, or with words that it has not.
std::unique_ptr<DeviceDriver> makeArmDriver(ArmTopics topics, const ArmOptions& options);

}  // namespace hapticd::tools::crtk
