#pragma once

#include <cstdint>

#include "rt/triple_buffer.h"
#include "rt/vec3.h"

namespace hapticd::rt {

/// What the handle measured last.
struct HandleState {
  Vec3 position_m_in_world;        ///< the HIP
  Vec3 velocity_m_per_s_in_world;  ///< for display and damping; never trusted for safety
  std::uint64_t sequence = 0;      ///< 0: nothing measured yet; +1 with each measurement
  std::int64_t time_ns = 0;        ///< CLOCK_MONOTONIC of the measurement
};

/// What the handle is to exert on the hand.
struct HandleCommand {
  Vec3 force_n_in_world;   ///< always finite and within the safety chain's limits
  std::uint64_t tick = 0;  ///< number of the force tick that computed it
};

/// From the handle's thread to the force thread, and back.
using HandleStateChannel = TripleBuffer<HandleState>;
using HandleCommandChannel = TripleBuffer<HandleCommand>;

}  // namespace hapticd::rt
