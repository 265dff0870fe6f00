// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/base/rigid_pose.h"
#include "rt/base/vec3.h"
#include "rt/base/words.h"
#include "rt/channels/triple_buffer.h"

namespace hapticd::rt {

/// State of the handle that decides how a measurement may be used.
enum class HandleCondition : std::uint8_t {
  ready,
  clutched,        ///< the clutch is held: the handle moves, the HIP does not, and there is no force
  not_calibrated,  ///< the device does not know its position yet (homing)
};
constexpr auto wordsOf(HandleCondition) {
  return words<HandleCondition>("ready", "clutched", "not_calibrated");
}

/// What became of a velocity that the device claims. hapticd computes with a velocity of its own, from the
/// positions: one that the device has filtered by a few milliseconds, which no check tells apart soon enough,
/// makes contact damping unstable (stiffness_limit.h).
enum class VelocityClaim : std::uint8_t {
  consistent,    ///< the positions agree
  none,          ///< the device claims none
  distrusted,    ///< the positions contradicted it earlier in this session
  contradicted,  ///< the positions contradict it now
};
constexpr auto wordsOf(VelocityClaim) {
  return words<VelocityClaim>("consistent", "none", "distrusted", "contradicted");
}

/// The newest measurement of the handle.
struct HandleState {
  Vec3 position_m_in_world;        ///< position of the HIP
  Vec3 velocity_m_per_s_in_world;  ///< velocity of the HIP, from the positions
  std::uint64_t sequence = 0;      ///< 0: nothing measured yet; incremented with each measurement
  std::int64_t time_ns = 0;        ///< CLOCK_MONOTONIC of the measurement
  std::uint64_t session = 0;       ///< incremented each time the device is opened or reconnected
  HandleCondition condition = HandleCondition::ready;
  std::uint32_t buttons = 0;  ///< bit n: button n is pressed
  /// From a motion of the hand to the force that responds to it, excluding the loop's own share.
  double delay_s = 0;
  /// Time from writing the command most recently sent to the device until it was sent; 0: none sent yet.
  std::int64_t command_latency_ns = 0;
  bool damps = false;  ///< the device damps contact by itself, see HandleCommand::contact_damping_n_s_per_m
  VelocityClaim velocity_claim = VelocityClaim::consistent;
  /// The device exerts forces over a link that cannot tell how late: the loop measures it (latency_probe.h).
  bool probes = false;
  bool has_orientation = false;          ///< the device measures how it is held
  bool has_gripper = false;              ///< the device measures a gripper
  Quaternion orientation_in_world = {};  ///< unit; maps vectors of the held tool to the world; see above
  double gripper_rad = 0;                ///< opening angle; 0: closed
};

/// Time for which a device exerts a command. Where the loop has not computed another one for longer, the
/// device exerts none.
inline constexpr std::int64_t kCommandLife_ns = 20'000'000;

/// The force that the handle is to exert on the hand.
struct HandleCommand {
  Vec3 force_n_in_world;      ///< at the hand; always finite and within the limits of the safety chain
  std::uint64_t tick = 0;     ///< number of the force tick that computed it; 0: none
  std::uint64_t session = 0;  ///< session of the measurement that it responds to
  std::int64_t time_ns = 0;   ///< CLOCK_MONOTONIC when it was written
  std::int64_t tick_ns = 0;   ///< CLOCK_MONOTONIC when the tick began
  /// For a device that damps contact by itself, using its own velocity v without delay: it subtracts this
  /// value times the component of v along the force from the force, but never reverses the force. At least 0.
  double contact_damping_n_s_per_m = 0;
  Vec3 torque_n_m_in_world = {};  ///< about the HIP; a law that computes none leaves it at zero
  double gripper_force_n = 0;     ///< > 0 opens
};

/// Carry measurements from the handle thread to the force thread and commands back.
using HandleStateChannel = TripleBuffer<HandleState>;
using HandleCommandChannel = TripleBuffer<HandleCommand>;

}  // namespace hapticd::rt
