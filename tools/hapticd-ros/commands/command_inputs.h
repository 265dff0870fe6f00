// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "config/base/error.h"
#include "tools/hapticd-ros/commands/box_commands.h"
#include "tools/hapticd-ros/dds/participant.h"

namespace hapticd::tools::ros {

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
