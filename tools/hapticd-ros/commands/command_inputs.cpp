// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-ros/commands/command_inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string_view>
#include <utility>

#include "config/base/value_text.h"
#include "daemon/trace/ros/message_set.h"
#include "rt/base/clock.h"
#include "tools/hapticd-ros/dds/subscription.h"
#include "tools/lib/ros/utc_clock.h"

namespace hapticd::tools::ros {

std::optional<std::string> MessageGate::refusal(const MessageHead& head, std::int64_t utc_ns, Time time) {
  if (!rules_.frame.empty() && head.frame != rules_.frame) {
    return fmt::format("its frame_id is {} and must be {} (transform it, then set header.frame_id)",
                       base::inQuotes(head.frame), base::inQuotes(rules_.frame));
  }
  if (auto old = refusalByAge(head, utc_ns)) return old;
  if (head.publisher == publisher_) newest_ = time;
  if (rules_.one_publisher && head.publisher != publisher_ && time - newest_ < kSilence)
    return "another publisher sends to this topic (end one of them)";
  if (!rate_.allows(time)) {
    return fmt::format(
        "there are more than {} messages a second, and the others are dropped (publish less often)",
        rules_.most_per_second);
  }
  return std::nullopt;
}

void MessageGate::used(const MessageHead& head, Time time) {
  publisher_ = head.publisher;
  newest_ = time;
}

std::optional<std::string> MessageGate::refusalByAge(const MessageHead& head, std::int64_t utc_ns) const {
  const std::chrono::nanoseconds age(utc_ns - head.made_utc_ns());
  if (age <= rules_.oldest && age >= -kEarliest) return std::nullopt;
  const double age_s = std::chrono::duration<double>(age).count();
  const char* const remedy = "synchronise the clocks of both computers, for instance with chrony";
  if (age_s < 0) return fmt::format("its time is {:.3f} s from now ({})", -age_s, remedy);
  return fmt::format("it is {:.3f} s old, and may be {:.3f} s (send it at once, and {})", age_s,
                     std::chrono::duration<double>(rules_.oldest).count(), remedy);
}

namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;
using trace::ros::StampedImpedance;
using trace::ros::StampedPose;
using trace::ros::StampedText;
using trace::ros::StampedWrench;

constexpr auto kLogPeriod = 10s;
/// Longest wait for messages.
constexpr auto kWait = 1s;

MessageHead headOf(const trace::ros::Header& header, const Origin& origin) {
  return {origin.publisher, header.time_ns, origin.sent_utc_ns, std::string(header.frame)};
}
/// When a message was made, CLOCK_MONOTONIC; one from a clock that is ahead of this computer's: now.
std::int64_t madeAt(const MessageHead& head) {
  return std::min(UtcClock().monotonic_ns(head.made_utc_ns()), rt::monotonicNow_ns());
}

struct InputTopic {
  std::string name;
  std::string_view message;
  int depth;
  Delivery delivery;
};

}  // namespace

/// The topics, and the loop that reads them.
class CommandInputs::Inputs {
 public:
  Inputs(const Participant& participant, std::string name_space, const std::string& control_socket,
         BoxState& state)
      : participant_(participant),
        name_space_(std::move(name_space)),
        box_(control_socket, state),
        wait_(participant) {}

  base::Result<void> addAll(const AllowedInputs& allowed);
  /// Until end() is called.
  void run();
  void end() { wait_.end(); }
  std::vector<InputState> states() const;

 private:
  using Refusal = BoxCommands::Refusal;
  struct Input {
    Subscription subscription;
    MessageGate gate;
    std::function<void(Input&)> take;
    InputState state;  // under the mutex
    Clock::time_point next_log = {};
  };

  /// Adds a topic whose messages the gate examines and `act` carries out.
  template <typename Message>
  base::Result<void> add(const InputTopic& topic, GateRules rules,
                         std::function<Refusal(const Message&, const MessageHead&)> act);
  void note(Input& input, const Refusal& refusal);
  Refusal force(const StampedWrench& message, const MessageHead& head);
  Refusal pose(const std::string& frame, const StampedPose& message, const MessageHead& head);

  const Participant& participant_;
  std::string name_space_;
  BoxCommands box_;
  MessageWait wait_;
  std::vector<std::unique_ptr<Input>> inputs_;
  mutable std::mutex mutex_;
};

template <typename Message>
base::Result<void> CommandInputs::Inputs::add(
    const InputTopic& topic, GateRules rules,
    std::function<Refusal(const Message&, const MessageHead&)> act) {
  const std::string name = name_space_ + "/" + topic.name;
  auto subscription = Subscription::open(participant_, name, topic.message, topic.depth, topic.delivery);
  if (!subscription) return std::unexpected(subscription.error());
  wait_.add(*subscription);
  InputState state{.topic = name, .message = topic.message, .reader = subscription->reader()};
  const auto take = [this, act = std::move(act)](Input& input) {
    input.subscription.takeAll<Message>([&](const Message& sample, const Origin& origin) {
      const MessageHead head = headOf(sample.header, origin);
      const Clock::time_point now = Clock::now();
      Refusal refusal = input.gate.refusal(head, rt::realtimeNow_ns(), now);
      if (!refusal && !(refusal = act(sample, head))) input.gate.used(head, now);
      note(input, refusal);
    });
  };
  inputs_.push_back(std::make_unique<Input>(
      Input{std::move(*subscription), MessageGate(std::move(rules)), take, std::move(state)}));
  return {};
}

base::Result<void> CommandInputs::Inputs::addAll(const AllowedInputs& allowed) {
  const std::string world = name_space_ + "/world";
  base::Result<void> added;
  if (allowed.state_command) {
    added = add<StampedText>(
        {"state_command", "crtk_msgs/StringStamped", 10, Delivery::each},
        {.most_per_second = 10, .oldest = 1s},
        [this](const auto& message, const MessageHead&) { return box_.changeState(message.text); });
  }
  if (added && allowed.servo_cf) {
    // Of the forces that have come meanwhile only the newest counts.
    added = add<StampedWrench>(
        {"servo_cf", "geometry_msgs/WrenchStamped", 1, Delivery::newest},
        {.most_per_second = 2000, .oldest = 20ms, .one_publisher = true, .frame = world},
        [this](const auto& message, const MessageHead& head) { return force(message, head); });
  }
  if (added && allowed.servo_ci) {
    added = add<StampedImpedance>(
        {"servo_ci", "crtk_msgs/CartesianImpedance", 1, Delivery::each},
        {.most_per_second = 10, .oldest = 1s, .one_publisher = true, .frame = world},
        [this](const auto& message, const MessageHead&) { return box_.setImpedance(message.impedance); });
  }
  for (const std::string& frame : allowed.frames) {
    if (!added) break;
    added = add<StampedPose>(
        {"frames/" + frame, "geometry_msgs/PoseStamped", 10, Delivery::newest},
        {.most_per_second = 500, .oldest = 200ms, .one_publisher = true, .frame = world},
        [this, frame](const auto& message, const MessageHead& head) { return pose(frame, message, head); });
  }
  return added;
}

void CommandInputs::Inputs::run() {
  while (!wait_.ended()) {
    for (const auto& input : inputs_) input->take(*input);
    wait_.wait(kWait);
  }
}

void CommandInputs::Inputs::note(Input& input, const Refusal& refusal) {
  {
    const std::lock_guard lock(mutex_);
    ++(refusal ? input.state.refused : input.state.taken);
    if (refusal) input.state.last_refusal = *refusal;
  }
  if (!refusal || Clock::now() < input.next_log) return;
  input.next_log = Clock::now() + kLogPeriod;
  fmt::print(stderr, "hapticd-ros: /{}: a message is refused: {}\n", input.state.topic,
             base::printable(*refusal));
}

std::vector<InputState> CommandInputs::Inputs::states() const {
  const std::lock_guard lock(mutex_);
  std::vector<InputState> all;
  for (const auto& input : inputs_) all.push_back(input->state);
  return all;
}

CommandInputs::Inputs::Refusal CommandInputs::Inputs::force(const StampedWrench& message,
                                                            const MessageHead& head) {
  if (!isFinite(message.force_n) || !isFinite(message.torque_n_m)) return "the wrench is not finite";
  if (!(message.torque_n_m == rt::Vec3{})) return "the box exerts no torques (set wrench.torque to 0)";
  return box_.addForce(message.force_n, madeAt(head));
}

CommandInputs::Inputs::Refusal CommandInputs::Inputs::pose(const std::string& frame,
                                                           const StampedPose& message,
                                                           const MessageHead& head) {
  const rt::Quaternion& q = message.pose.orientation;
  if (!isFinite(message.pose.position_m_in_world) || !std::isfinite(dot(q, q)))
    return "the pose is not finite";
  return box_.feedPose(frame, message.pose, madeAt(head));
}

base::Result<std::unique_ptr<CommandInputs>> CommandInputs::open(const Participant& participant,
                                                                 const AllowedInputs& allowed,
                                                                 const std::string& name_space,
                                                                 const std::string& control_socket,
                                                                 BoxState& state) {
  auto inputs = std::make_unique<Inputs>(participant, name_space, control_socket, state);
  if (auto added = inputs->addAll(allowed); !added) return std::unexpected(added.error());
  return std::unique_ptr<CommandInputs>(new CommandInputs(std::move(inputs)));
}

CommandInputs::CommandInputs(std::unique_ptr<Inputs> inputs)
    : inputs_(std::move(inputs)), thread_([this] { inputs_->run(); }) {}

CommandInputs::~CommandInputs() {
  inputs_->end();
  thread_.join();
}

std::vector<InputState> CommandInputs::states() const {
  return inputs_->states();
}

}  // namespace hapticd::tools::ros
