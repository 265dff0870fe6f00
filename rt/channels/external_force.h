// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/base/realtime_safe.h"
#include "rt/base/vec3.h"
#include "rt/channels/triple_buffer.h"

namespace hapticd::rt {

/// A force on the hand that another program wishes to add to that of the laws.
struct ExternalForce {
  Vec3 force_n_in_world;     ///< finite
  std::int64_t time_ns = 0;  ///< when it was computed, CLOCK_MONOTONIC; 0: never
};
using ExternalForceChannel = TripleBuffer<ExternalForce>;

/// Age after which an external force no longer acts. It acts in full for half of this time, and fades over
/// the other half.
inline constexpr std::int64_t kExternalForceLife_ns = 20'000'000;

/// Returns what is left of an external force at a time: the dead man of its sender.
/// Thread: any.  Progress: wait-free.  RT: safe.
inline Vec3 externalForceAt(const ExternalForce& newest, std::int64_t now_ns) HAPTICD_RT {
  constexpr std::int64_t kFull_ns = kExternalForceLife_ns / 2;
  const std::int64_t age_ns = now_ns - newest.time_ns;
  if (newest.time_ns == 0 || age_ns >= kExternalForceLife_ns) return {};
  if (age_ns <= kFull_ns) return newest.force_n_in_world;
  const auto left_ns = static_cast<double>(kExternalForceLife_ns - age_ns);
  return (left_ns / static_cast<double>(kExternalForceLife_ns - kFull_ns)) * newest.force_n_in_world;
}

}  // namespace hapticd::rt
