// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "config/base/error.h"
#include "config/base/rate_limit.h"
#include "tools/hapticd-ros/commands/box_commands.h"
#include "tools/hapticd-ros/dds/participant.h"

namespace hapticd::tools::ros {

/// What is known of a message from the network beside its content.
struct MessageHead {
  std::uint64_t publisher = 0;
  std::int64_t stamp_utc_ns = 0;  ///< of its header; 0: none
  std::int64_t sent_utc_ns = 0;   ///< when it was handed to DDS
  std::string frame = {};

  /// When it was made, as far as its sender tells.
  std::int64_t made_utc_ns() const noexcept { return stamp_utc_ns != 0 ? stamp_utc_ns : sent_utc_ns; }
};

/// What the messages of a topic must be like.
struct GateRules {
  int most_per_second = 0;
  std::chrono::nanoseconds oldest{};
  /// Only one at a time: the first whose message was used, until it is silent for MessageGate::kSilence.
  bool one_publisher = false;
  std::string frame = {};  ///< the only frame_id; empty: any
};

/// Decides which messages of a topic are taken.
/// Thread: one.
class MessageGate {
 public:
  static constexpr std::chrono::seconds kSilence{1};
  /// Clocks of two computers that are synchronised differ by less.
  static constexpr std::chrono::milliseconds kEarliest{5};

  explicit MessageGate(GateRules rules) : rules_(std::move(rules)), rate_(rules_.most_per_second) {}

  /// Returns why a message is refused, and what to do; nothing: its content may be used.
  /// utc_ns: now. time: now, not earlier than at the last call.
  std::optional<std::string> refusal(const MessageHead& head, std::int64_t utc_ns,
                                     std::chrono::steady_clock::time_point time);
  /// Notes that the content of a message was valid and is used.
  void used(const MessageHead& head, std::chrono::steady_clock::time_point time);

 private:
  using Time = std::chrono::steady_clock::time_point;

  std::optional<std::string> refusalByAge(const MessageHead& head, std::int64_t utc_ns) const;

  GateRules rules_;
  base::RateLimit rate_;
  std::uint64_t publisher_ = 0;  // of the newest that was used
  Time newest_;                  // of this publisher
};

/// Topics by which programs in the network may command the box; only these are subscribed to.
struct AllowedInputs {
  bool state_command = false;
  bool servo_cf = false;
  bool servo_ci = false;
  std::vector<std::string> frames = {};  ///< names of moving frames of hapticd

  bool any() const { return state_command || servo_cf || servo_ci || !frames.empty(); }
};

/// What came of the messages of a topic.
struct InputState {
  std::string topic;         ///< "hapticd/servo_cf"
  std::string_view message;  ///< "geometry_msgs/WrenchStamped"
  dds_entity_t reader = 0;
  std::uint64_t taken = 0;
  std::uint64_t refused = 0;
  std::string last_refusal = {};  ///< empty: none
};

/// Takes commands from the network, examines each of them and hands it to hapticd. What is refused is counted
/// and logged. It has a thread of its own: a force is worth something for 20 ms only.
/// Thread: all functions from one thread.
class CommandInputs {
 public:
  /// name_space: begins the names of topics and frames. `state` outlives this.
  static base::Result<std::unique_ptr<CommandInputs>> open(const Participant& participant,
                                                           const AllowedInputs& allowed,
                                                           const std::string& name_space,
                                                           const std::string& control_socket,
                                                           BoxState& state);
  ~CommandInputs();
  CommandInputs(const CommandInputs&) = delete;
  CommandInputs& operator=(const CommandInputs&) = delete;

  std::vector<InputState> states() const;

 private:
  class Inputs;

  explicit CommandInputs(std::unique_ptr<Inputs> inputs);

  std::unique_ptr<Inputs> inputs_;
  std::thread thread_;
};

}  // namespace hapticd::tools::ros
