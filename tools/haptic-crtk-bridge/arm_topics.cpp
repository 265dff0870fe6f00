// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-crtk-bridge/arm_topics.h"

#include <fmt/format.h>

#include <utility>

#include "daemon/trace/ros/message_set.h"

namespace hapticd::tools::crtk {
namespace {

constexpr int kPosesKept = 64;
constexpr std::chrono::milliseconds kSettingsPatience{200};

/// Opens topics of one arm and keeps the first error.
class Opening {
 public:
  Opening(const ros::Participant& participant, const std::string& arm)
      : participant_(participant), prefix_(arm + "/") {}

  base::Result<ros::Subscription> subscribe(const std::string& name, std::string_view message, int depth,
                                            ros::Delivery delivery = ros::Delivery::newest) {
    return kept(ros::Subscription::open(participant_, prefix_ + name, message, depth, delivery));
  }
  base::Result<ros::Publisher> publish(const std::string& name, std::string_view message,
                                       ros::Publisher::Late late) {
    return kept(ros::Publisher::open(participant_, prefix_ + name, message, late));
  }
  const std::optional<base::Error>& error() const { return error_; }

 private:
  template <typename Opened>
  Opened kept(Opened opened) {
    if (!opened && !error_) error_ = opened.error();
    return opened;
  }

  const ros::Participant& participant_;
  std::string prefix_;
  std::optional<base::Error> error_;
};

std::string poseName(const ArmOptions& options) {
  // the spatial wrenches of a dVRK are those of the first frame of its kinematic chain, in which
  // local/measured_cp is given, and not those of measured_cp, which has a base frame in front
  return options.convention == WrenchConvention::spatial ? "local/measured_cp" : "measured_cp";
}

std::string wrenchName(const ArmOptions& options) {
  return options.convention == WrenchConvention::spatial ? "spatial/servo_cf" : "body/servo_cf";
}

constexpr const char* kAbsoluteName = "body/set_cf_orientation_absolute";
constexpr const char* kGravityName = "use_gravity_compensation";

}  // namespace

std::string poseTopicOf(const ArmOptions& options) {
  return "/" + options.arm + "/" + poseName(options);
}

std::string wrenchTopicOf(const ArmOptions& options) {
  return "/" + options.arm + "/" + wrenchName(options);
}

ArmTopics::ArmTopics(ros::Participant participant, ArmOptions options, const Ends& ends)
    : participant_(std::move(participant)), options_(std::move(options)), ends_(ends), wait_(participant_) {
  for (const ros::Subscription& subscription :
       {ends.poses, ends.states, ends.last_states, ends.settings_seen})
    wait_.add(subscription);
}

base::Result<ArmTopics> ArmTopics::open(const ros::Network& network, const ArmOptions& options) {
  auto participant = ros::Participant::join(network);
  if (!participant) return std::unexpected(participant.error());
  using Last = ros::Publisher::Late;
  Opening opening(*participant, options.arm);
  const auto poses = opening.subscribe(poseName(options), "geometry_msgs/PoseStamped", kPosesKept);
  const auto states =
      opening.subscribe("operating_state", "crtk_msgs/OperatingState", 10, ros::Delivery::each);
  const auto last_states =
      opening.subscribe("operating_state", "crtk_msgs/OperatingState", 10, ros::Delivery::last);
  const auto grippers = opening.subscribe("gripper/measured_js", "sensor_msgs/JointState", 1);
  const auto settings = opening.subscribe(kAbsoluteName, "std_msgs/Bool", 10, ros::Delivery::each);
  const auto seen = opening.subscribe(wrenchName(options), "geometry_msgs/WrenchStamped", 1);
  const auto wrenches =
      opening.publish(wrenchName(options), "geometry_msgs/WrenchStamped", Last::gets_nothing);
  const auto absolute = opening.publish(kAbsoluteName, "std_msgs/Bool", Last::gets_last);
  const auto gravity = opening.publish(kGravityName, "std_msgs/Bool", Last::gets_last);
  if (opening.error()) return std::unexpected(*opening.error());
  return ArmTopics(
      std::move(*participant), options,
      {*poses, *states, *last_states, *grippers, *settings, *seen, *wrenches, *absolute, *gravity});
}

void ArmTopics::takePoses(const std::function<void(const MeasuredPose&)>& take) {
  ends_.poses.takeAll<trace::ros::StampedPose>([&take](const auto& message, const ros::Origin& origin) {
    take({std::string(message.header.frame), message.header.time_ns, message.pose.position_m_in_world,
          message.pose.orientation, origin.publisher});
  });
}

std::optional<ArmState> ArmTopics::takeState() {
  std::optional<ArmState> newest;
  std::int64_t newest_ns = 0;
  const auto take = [&](const trace::ros::StampedState& message, const ros::Origin& origin) {
    if (newest && origin.sent_utc_ns < newest_ns) return;
    newest = ArmState{std::string(message.state.state), message.state.is_homed};
    newest_ns = origin.sent_utc_ns;
  };
  ends_.last_states.takeAll<trace::ros::StampedState>(take);
  ends_.states.takeAll<trace::ros::StampedState>(take);
  return newest;
}

std::optional<double> ArmTopics::takeGripper() {
  std::optional<double> newest;
  ends_.grippers.takeAll<trace::ros::JointPositions>([&newest](const auto& message, const ros::Origin&) {
    if (!message.positions.empty()) newest = message.positions.front();
  });
  return newest;
}

bool ArmTopics::takeContrarySetting() {
  bool contrary = false;
  ends_.settings_seen.takeAll<trace::ros::Flag>([&](const trace::ros::Flag& message, const ros::Origin&) {
    contrary = contrary || message.flag != wantsAbsolute();
  });
  return contrary && setsAxes();
}

bool ArmTopics::sendSettings() {
  const auto send = [](ros::Publisher& publisher, bool flag) {
    std::string message;
    trace::ros::encodeFlag(flag, message);
    return publisher.write(std::move(message)) && publisher.isAcknowledged(kSettingsPatience);
  };
  return (!setsAxes() || send(ends_.absolute, wantsAbsolute())) &&
         (!options_.gravity_compensation || send(ends_.gravity, true));
}

bool ArmTopics::sendWrench(const std::string& frame, std::int64_t utc_ns, const Wrench& wrench) {
  std::string message;
  trace::ros::encodeWrench({utc_ns, frame}, wrench.force_n, wrench.torque_n_m, message);
  return ends_.wrenches.write(std::move(message));
}

std::optional<base::Error> ArmTopics::problem() const {
  const auto unheard = [this](const char* name, const char* remedy) {
    return base::Error{"/" + options_.arm + "/" + name, "nobody subscribes to it", remedy};
  };
  if (ends_.wrenches.subscribers() == 0)
    return unheard(
        wrenchName(options_).c_str(),
        "is this an arm of CRTK? 'haptic-crtk-bridge check' tries another --wrench with little force");
  // what is recommended here has to be safe for an arm of which nothing is known: a force along other axes
  // than meant may pull into the wall that it is to push out of
  if (wantsAbsolute() && ends_.absolute.subscribers() == 0) {
    return unheard(
        kAbsoluteName,
        "without it the direction of a force is not known; 'haptic-crtk-bridge check --wrench base' "
        "finds it with little force, in several orientations of the tool");
  }
  if (options_.convention == WrenchConvention::base && ends_.absolute.subscribers() > 0) {
    return base::Error{"--wrench base",
                       "is for arms that know one direction of forces only, and this one takes "
                       "body/set_cf_orientation_absolute",
                       "leave --wrench out"};
  }
  if (options_.gravity_compensation && ends_.gravity.subscribers() == 0)
    return unheard(kGravityName, "leave --gravity-compensation out for an arm without it");
  if (ends_.wrenches_seen.publishers() > 0) {
    return base::Error{wrenchTopicOf(options_), "another program publishes it, too",
                       "end the other one: whichever is last would move the hand"};
  }
  return std::nullopt;
}

}  // namespace hapticd::tools::crtk
