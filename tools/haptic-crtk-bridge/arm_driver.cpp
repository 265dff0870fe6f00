// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "config/base/value_text.h"
#include "rt/base/clock.h"
#include "tools/haptic-crtk-bridge/arm_topics.h"
#include "tools/lib/device/threaded_device.h"

namespace hapticd::tools::crtk {
namespace {

constexpr std::int64_t kAwait_ns = rt::kNsPerSecond;
/// After the settings have arrived, for the arm to act upon them.
constexpr std::int64_t kSettle_ns = 200'000'000;
/// Without a measurement; the device is lost long before, and this is when it is looked for anew.
constexpr std::int64_t kLost_ns = rt::kNsPerSecond;
constexpr std::int64_t kLook_ns = 100'000'000;
/// How long wrenches of zero are sent where the arm must exert nothing.
constexpr std::int64_t kLastZeros_ns = 100'000'000;
constexpr int kZerosAtTheEnd = 20;
constexpr std::chrono::milliseconds kZeroPatience{500};

/// Drives an arm that speaks CRTK over DDS. No wrench has an end of its own there, so each session ends with
/// wrenches of zero that the arm has acknowledged, or with words that it has not.
/// Thread: one.
class ArmDriver final : public DeviceDriver {
 public:
  static constexpr std::int64_t kTick_ns = 1'000'000;
  /// What CRTK knows no limit for; what a person bears is limited by the bridge.
  static constexpr double kMostForce_n = 100;

  ArmDriver(ArmTopics topics, ArmOptions options)
      : topics_(std::move(topics)), options_(std::move(options)), gate_(options_.frame) {}

  base::Result<void> drive(DeviceSession& session) override {
    topics_.takePoses([](const MeasuredPose&) {});  // of before
    gate_.beginSession();
    delay_.reset();
    pose_.reset();
    pose_ns_ = 0;
    ending_.reset();
    send_until_ns_ = 0;
    if (auto ready = await(session); !ready || session.ends()) return ready;
    session.opened({.model = fmt::format("/{} (frame {}, {})", options_.arm, base::inQuotes(gate_.frame()),
                                         wrenchTopicOf(options_)),
                    .serial = "",
                    .limits = {.force_n = kMostForce_n}});
    auto ended = follow(session);
    letGo(session);
    return ended;
  }

 private:
  base::Result<void> await(DeviceSession& session) {
    const std::int64_t until_ns = rt::monotonicNow_ns() + kAwait_ns;
    std::optional<base::Error> wrong;
    do {
      hear(session, rt::monotonicNow_ns() + kLook_ns / 10);
      if (ending_) return std::unexpected(*ending_);
      wrong = missing(rt::monotonicNow_ns());
    } while (wrong && rt::monotonicNow_ns() < until_ns && !session.ends());
    if (session.ends()) return {};
    if (wrong) return std::unexpected(*wrong);
    if (!topics_.sendSettings()) {
      return std::unexpected(base::Error{"/" + options_.arm, "did not acknowledge its settings within 0.2 s",
                                         "is its program busy?"});
    }
    hear(session, rt::monotonicNow_ns() + kSettle_ns);
    if (ending_) return std::unexpected(*ending_);
    return {};
  }

  /// What the arm lacks before it may be used.
  std::optional<base::Error> missing(std::int64_t now_ns) const {
    if (auto problem = topics_.problem()) return problem;
    if (!pose_ || now_ns - pose_ns_ > kDeadManNs) {
      const bool rejected = gate_.lastFault() != PoseFault::none;
      return base::Error{poseTopicOf(options_),
                         rejected ? fmt::format("a measurement was rejected: {}", textOf(gate_.lastFault()))
                                  : "no measurement comes",
                         rejected ? "" : "compare domain, interface and the name of the arm"};
    }
    if (!state_)
      return base::Error{"/" + options_.arm + "/operating_state", "no state has come",
                         "some arms tell it only when it changes: disable and enable the arm once"};
    return std::nullopt;
  }

  base::Result<void> follow(DeviceSession& session) {
    rt::PeriodicClock ticks(kTick_ns);
    ticks.start(rt::monotonicNow_ns());
    while (!session.ends()) {
      hear(session, ticks.planned_ns());
      const std::int64_t now_ns = rt::monotonicNow_ns();
      exert(session, now_ns);
      if (now_ns >= next_look_ns_) {
        next_look_ns_ = now_ns + kLook_ns;
        if (auto problem = topics_.problem()) ending_ = problem;
        complain(session);
      }
      if (now_ns - pose_ns_ > kLost_ns)
        ending_ = base::Error{poseTopicOf(options_), "no measurement has come for 1 s", ""};
      if (ending_) return std::unexpected(*ending_);
      ticks.advance(rt::monotonicNow_ns());
    }
    return {};
  }

  /// Takes messages until then.
  void hear(DeviceSession& session, std::int64_t until_ns) {
    do {
      const std::int64_t rest_ns = until_ns - rt::monotonicNow_ns();
      if (rest_ns > 0) topics_.wait(std::chrono::nanoseconds(rest_ns));
      take(session);
    } while (!ending_ && !session.ends() && rt::monotonicNow_ns() < until_ns);
  }

  void take(DeviceSession& session) {
    const std::int64_t now_ns = rt::monotonicNow_ns();
    if (auto state = topics_.takeState()) {
      if (state != state_ && !state->state.empty())
        session.say(fmt::format("/{} is {}{}", options_.arm, base::printable(state->state),
                                state->is_homed ? "" : ", not homed"));
      state_ = std::move(state);
    }
    if (const auto gripper_rad = topics_.takeGripper()) {
      gripper_rad_ = gripper_rad;
      gripper_ns_ = now_ns;
    }
    if (topics_.takeContrarySetting()) {
      ending_ = base::Error{"/" + options_.arm + "/body/set_cf_orientation_absolute",
                            "another program has set the axes of wrenches otherwise",
                            "end the other one; the setting is sent again"};
    }
    pose_is_new_ = false;
    topics_.takePoses([this, now_ns](const MeasuredPose& pose) { judge(pose, now_ns); });
    if (pose_is_new_) publish(session, now_ns);
  }

  void judge(const MeasuredPose& pose, std::int64_t now_ns) {
    const PoseFault fault = gate_.judge(pose);
    if (fault != PoseFault::none) fault_ = fault;
    if (fault == PoseFault::none) {
      delay_.add(pose.stamp_utc_ns, rt::realtimeNow_ns());
      pose_ = pose;
      pose_ns_ = now_ns;
      pose_is_new_ = true;
    }
    if (fault == PoseFault::other_frame) {
      ending_ = base::Error{poseTopicOf(options_),
                            fmt::format("its frame_id is {} and not {}: no force, because it would point "
                                        "somewhere else",
                                        base::inQuotes(pose.frame), base::inQuotes(gate_.frame())),
                            "set the arm back; or start again, with the pose of the handle of that frame in "
                            "hapticd's settings"};
    }
    if (fault == PoseFault::other_publisher) {
      ending_ = base::Error{poseTopicOf(options_), "another program publishes it than before",
                            "the arm was started again, or there are two of this name"};
    }
  }

  /// Passes the newest measurement on.
  void publish(DeviceSession& session, std::int64_t now_ns) {
    DeviceReading reading;
    reading.position_m = pose_->position_m;
    reading.orientation = normalised(pose_->orientation);
    if (now_ns - gripper_ns_ < kDeadManNs) reading.gripper_rad = gripper_rad_;
    reading.calibrated = mayExert();
    reading.fault = state_ && state_->state == "FAULT";
    reading.latency_ns = delay_.latency_ns();
    if (session.exchange().publish(reading, now_ns) == ReadingVerdict::jumped) jumped_ = true;
  }

  /// The exchange gives no force where the newest measurement is old, wrong, or of a state without force.
  void exert(DeviceSession& session, std::int64_t now_ns) {
    const DeviceCommand command = session.exchange().commandAt(now_ns);
    was_stale_ = was_stale_ || now_ns - pose_ns_ > kDeadManNs;
    if (mayExert()) send_until_ns_ = now_ns + kLastZeros_ns;
    if (now_ns < send_until_ns_) send(mayExert() ? command.force_n : rt::Vec3{});
  }

  void send(const rt::Vec3& force_n_in_frame) {
    const Wrench wrench =
        wrenchOf(options_.convention, force_n_in_frame, {pose_->position_m, normalised(pose_->orientation)});
    if (!topics_.sendWrench(gate_.frame(), rt::realtimeNow_ns(), wrench)) ++unsent_;
  }

  void letGo(DeviceSession& session) {
    session.exchange().close();
    if (send_until_ns_ == 0) return;  // it never got a wrench
    for (int i = 0; i < kZerosAtTheEnd; ++i) {
      send({});
      rt::sleepUntil(rt::monotonicNow_ns() + kTick_ns);
    }
    if (!topics_.wrenchesArrived(kZeroPatience)) {
      session.say(fmt::format("/{} did not acknowledge the zero force: it may go on with the last one",
                              options_.arm));
    }
  }

  /// Says what is wrong, without ending the session.
  void complain(DeviceSession& session) {
    const std::string topic = poseTopicOf(options_);
    of_fault_.update(session, static_cast<int>(fault_),
                     fmt::format("{}: a measurement was rejected: {}", topic, textOf(fault_)));
    of_jump_.update(session, jumped_,
                    fmt::format("{}: it jumped farther than a hand moves: no force meanwhile", topic));
    of_stale_.update(session, was_stale_,
                     fmt::format("{}: no measurement for {} ms: no force", topic, kDeadManNs / 1'000'000));
    of_clock_.update(
        session, delay_.measured() && !delay_.trustsStamps(),
        fmt::format("{}: its stamps do not go with this computer's clock, so {} ms are taken for "
                    "the delay of the network in each direction, and contact is softer: "
                    "synchronise the clocks",
                    topic, ArmDelay::kUnknownWay_ns / 1'000'000));
    of_unsent_.update(session, unsent_ > 0,
                      fmt::format("{}: {} forces could not be sent", wrenchTopicOf(options_), unsent_));
    fault_ = PoseFault::none;
    jumped_ = was_stale_ = false;
    unsent_ = 0;
  }

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

}  // namespace

std::unique_ptr<DeviceDriver> makeArmDriver(ArmTopics topics, const ArmOptions& options) {
  return std::make_unique<ArmDriver>(std::move(topics), options);
}

}  // namespace hapticd::tools::crtk
