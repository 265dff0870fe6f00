// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <expected>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/trace/ros/message_set.h"
#include "rt/base/rigid_pose.h"
#include "rt/base/vec3.h"
#include "rt/loop/loop_state.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools::ros {

using trace::ros::Impedance;
using trace::ros::ImpedanceSide;

/// The names of all fixtures that an impedance may become: "ros-x-positive" and so on.
std::vector<std::string> impedanceFixtureNames();

/// The fixtures of hapticd that do what an impedance asks for: a plane for each side of an axis that has a
/// spring, with its stiffness, damping and deadband. A list of objects for ChangeFixtures, empty if there is
/// no spring.
/// Errors: a sentence about what no passive fixture does: springs and dampers that push, a bias, torques, and
/// numbers that are not finite or beyond what fixtures may have.
/// Thread: any.
std::expected<Json, std::string> fixturesOf(const Impedance& impedance);

/// What the two threads of hapticd-ros know of the box. hapticd has no pause that lasts: a box that was
/// paused over the network is disengaged, and resumes by being engaged again; its first tick that is not idle
/// ends the pause, whoever engaged it. Thread: any.
struct BoxState {
  std::atomic<bool> answers{false};
  std::atomic<rt::Mode> mode{rt::Mode::starting};  ///< set by the one that reads ticks
  /// CLOCK_MONOTONIC; 0: not paused; kPausing: hapticd is being asked
  std::atomic<std::int64_t> paused_since_ns{0};
  static constexpr std::int64_t kPausing = std::numeric_limits<std::int64_t>::max();
};

/// Does in hapticd what messages ask for, over its control socket. Every function returns why it was not
/// done; nothing: it was. A call takes at most kLimit. Thread: one.
class BoxCommands {
 public:
  static constexpr std::chrono::milliseconds kLimit{1000};

  /// `control_socket`: of hapticd, which may come and go.
  BoxCommands(std::string control_socket, BoxState& state)
      : control_socket_(std::move(control_socket)), state_(state) {}

  using Refusal = std::optional<std::string>;
  /// A state_command of CRTK: enable, disable, pause or resume.
  Refusal changeState(std::string_view command);
  /// time_ns: when it was computed, CLOCK_MONOTONIC.
  Refusal addForce(const rt::Vec3& force_n_in_world, std::int64_t time_ns);
  /// Replaces the fixtures of the impedance before.
  Refusal setImpedance(const trace::ros::Impedance& impedance);
  Refusal feedPose(const std::string& frame, const rt::RigidPose& T_world_frame, std::int64_t time_ns);

 private:
  Refusal enable();
  Refusal pause();
  /// Calls a method and returns the parameters of its reply, or why there is none.
  std::expected<Json, std::string> call(const std::string& method, const Json& parameters = Json::object());
  Refusal done(const std::expected<Json, std::string>& reply) const;

  std::string control_socket_;
  BoxState& state_;
  std::optional<VarlinkClient> client_;
  std::optional<Json> fixtures_;  // of the newest impedance, as they were sent
};

}  // namespace hapticd::tools::ros
