// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/triple_buffer.h"
#include "rt/vec3.h"
#include "rt/words.h"

namespace hapticd::rt {

/// What may be done with a measurement.
enum class HandleCondition : std::uint8_t {
  ready,
  clutched,        ///< the person holds the clutch: the handle moves, the HIP does not, and nothing is felt
  not_calibrated,  ///< the device does not know yet where it is (homing)
};
constexpr auto wordsOf(HandleCondition) {
  return words<HandleCondition>("ready", "clutched", "not_calibrated");
}

/// What the handle measured last.
struct HandleState {
  Vec3 position_m_in_world;        ///< the HIP
  Vec3 velocity_m_per_s_in_world;  ///< of the HIP
  std::uint64_t sequence = 0;      ///< 0: nothing measured yet; +1 with each measurement
  std::int64_t time_ns = 0;        ///< CLOCK_MONOTONIC of the measurement
  std::uint64_t session = 0;       ///< +1 each time that the device is opened or comes back
  HandleCondition condition = HandleCondition::ready;
  std::uint32_t buttons = 0;  ///< bit n: button n is held
  double delay_s = 0;  ///< from a motion of the hand to the force that answers it, without the loop's own
  std::int64_t command_latency_ns = 0;  ///< how long a command had waited, from its writing to the newest
                                        ///< sending to the device; 0: none yet
  bool damps = false;  ///< the device damps contact by itself (HandleCommand::contact_damping_n_s_per_m)
};

/// What the handle is to exert on the hand.
struct HandleCommand {
  Vec3 force_n_in_world;      ///< newtons at the hand; always finite and within the safety chain's limits
  std::uint64_t tick = 0;     ///< number of the force tick that computed it; 0: none
  std::uint64_t session = 0;  ///< of the measurement that it answers
  std::int64_t time_ns = 0;   ///< CLOCK_MONOTONIC of its writing
  std::int64_t tick_ns = 0;   ///< CLOCK_MONOTONIC when the tick began
  /// For a device that damps contact by itself, from its own velocity v and without delay: it takes this
  /// times v's component along the force away from the force, but never turns it round. At least 0.
  double contact_damping_n_s_per_m = 0;
};

/// From the handle's thread to the force thread, and back.
using HandleStateChannel = TripleBuffer<HandleState>;
using HandleCommandChannel = TripleBuffer<HandleCommand>;

}  // namespace hapticd::rt
