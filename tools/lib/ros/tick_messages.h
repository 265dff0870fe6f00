// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "daemon/trace/ros/message_set.h"
#include "rt/base/rigid_pose.h"
#include "rt/base/vec3.h"
#include "rt/loop/loop_state.h"

/// What of a tick becomes a message, and the states of CRTK. Functions: thread: any.  RT: not safe.
namespace hapticd::tools::ros {

using trace::ros::HeldButtons;
using trace::ros::OperatingState;

/// A measurement of the handle that may be published.
struct Measurement {
  std::int64_t time_ns = 0;  ///< CLOCK_MONOTONIC
  rt::RigidPose T_world_tool;
  rt::Vec3 velocity_m_per_s_in_world;
};

/// Of a box that was paused over the network.
inline constexpr std::string_view kPaused = "PAUSED";

/// While hapticd does not answer.
inline constexpr OperatingState kBoxAbsent{"DISABLED", false, false};

/// A handle whose newest measurement is older than this is not homed: it may be elsewhere by now.
inline constexpr std::int64_t kMeasurementLife_ns = 500'000'000;

OperatingState operatingStateOf(const rt::Tick& tick);

/// Whether the position and velocity of the tick's measurement may be published: they are there, finite, and
/// of a device that knows where it is.
bool isMeasured(const rt::Tick& tick);

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
