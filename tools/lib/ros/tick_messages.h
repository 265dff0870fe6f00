// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "rt/base/rigid_pose.h"
#include "rt/base/vec3.h"
#include "rt/loop/loop_state.h"

namespace hapticd::tools::ros {

/// A measurement of the handle that may be published.
struct Measurement {
  std::int64_t time_ns = 0;  ///< CLOCK_MONOTONIC
  rt::RigidPose T_world_tool;
  rt::Vec3 velocity_m_per_s_in_world;
};

/// What sensor_msgs/Joy says of a handle.
struct HeldButtons {
  std::int64_t time_ns = 0;        ///< CLOCK_MONOTONIC of the measurement
  std::vector<float> axes;         ///< the opening angle of the gripper in radians; empty: there is none
  std::vector<std::int32_t> held;  ///< by button: 1 while it is held, else 0
};

/// Decides what of the ticks becomes a message, for topics and for bags alike.
/// Thread: one.  RT: not safe.
class TickMessages {
 public:
  /// The measurement of a tick, each once: a handle that is gone, or slower than the ticks, has no new one.
  /// Nothing where its position means nothing (isMeasured()).
  std::optional<Measurement> newMeasurement(const rt::Tick& tick);

  /// The buttons, when one of them has changed, and once a second. All ticks are to be shown to it: a button
  /// may be held for less than the period of the other messages.
  std::optional<HeldButtons> newButtons(const rt::Tick& tick);

  /// Forgets what was published, for ticks of another run of hapticd.
  void restart();

 private:
  static constexpr std::size_t kFewestButtons = 4;

  std::uint64_t measurement_ = 0;  // the newest that was returned
  std::optional<std::uint32_t> buttons_;
  std::int64_t next_buttons_ns_ = 0;
  std::size_t button_count_ = kFewestButtons;
};

/// The force that the handle was told to exert on the hand, in newtons; nothing where it is not finite.
std::optional<rt::Vec3> commandedForce(const rt::Tick& tick);

}  // namespace hapticd::tools::ros
