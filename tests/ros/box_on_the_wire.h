// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ros_messages.h"
#include "rt/base/clock.h"
#include "rt/base/vec3.h"
#include "tests/ros/ros_listener.h"
#include "tests/ros/scene_messages.h"
#include "tests/support/program.h"
#include "tests/system/support/daemon_under_test.h"

namespace hapticd::test {

/// A wall that the hand presses against, so that there is a force from the first second on.
inline const std::string kEngagedYaml = std::string(kWallYaml) + "control: {engage_at_start: true}\n";

/// crtk_msgs/OperatingState.
struct State {
  std::string state;
  bool is_homed = false;
  bool is_busy = false;
};

/// hapticd-ros, and a program of DDS that listens; a test adds hapticd.
class BoxOnTheWire : public ::testing::Test {
 protected:
  void startBridge(const std::vector<std::string>& more = {}, const ProgramOptions& options = {}) {
    std::vector<std::string> command{
        HAPTICD_ROS_PROGRAM, "--socket", home_.statusSocket(), "--domain", std::to_string(domain_),
        "--namespace",       namespace_};
    command.insert(command.end(), more.begin(), more.end());
    bridge_.emplace(command, options);
  }
  std::string topic(const std::string& name) const { return "rt/" + namespace_ + "/" + name; }
  bool says(const std::string& text) {
    return becomesTrue([&] { return bridge_->errors().find(text) != std::string::npos; });
  }
  std::size_t timesSaid(const std::string& text) const {
    const std::string all = bridge_->errors();
    std::size_t times = 0;
    for (std::size_t at = all.find(text); at != all.npos; at = all.find(text, at + 1)) ++times;
    return times;
  }
  void listenToState() {
    listener_.subscribe(topic("operating_state"), crtk_msgs_msg_dds__OperatingState__desc, /*late=*/true);
  }
  bool stateBecomes(const std::string& state) {
    return becomesTrue([&] {
      for (const std::string& message : listener_.take(topic("operating_state"))) {
        CdrBytes bytes(message);
        EXPECT_EQ(headerFrom(bytes).frame, namespace_ + "/world");
        state_.state = bytes.text();
        state_.is_homed = bytes.number<std::uint8_t>() != 0;
        state_.is_busy = bytes.number<std::uint8_t>() != 0;
        states_.push_back(state_.state);
      }
      return state_.state == state;
    });
  }
  bool hears(const std::string& name) {
    return becomesTrue([&] { return !listener_.take(topic(name)).empty(); });
  }

  int domain_ = ownDomain();
  std::string namespace_ = ownNamespace();
  DaemonHome home_;
  RosListener listener_{domain_};
  std::optional<Program> bridge_;
  State state_;
  std::vector<std::string> states_;  ///< all that have come
};

}  // namespace hapticd::test
