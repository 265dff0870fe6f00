// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "config/error.h"
#include "tools/hapticbench/jitter/cyclictest.h"
#include "tools/hapticbench/jitter/wakeup_counts.h"
#include "tools/lib/child/interrupt.h"

namespace hapticd::tools {

/// Measurements of hapticd's loop in one phase.
struct LoopRun {
  WakeupCounts wakeups;
  /// From the writing of a command by the loop to its taking effect at the simulated handle.
  WakeupCounts last_hop;
  std::uint64_t overruns = 0;       ///< ticks that ended after the next one was due
  std::uint64_t lost_ticks = 0;     ///< not in `wakeups`, because the ring was full
  std::uint64_t contact_ticks = 0;  ///< ticks in contact
  std::int64_t longest_tick_ns = 0;
};

/// Runs the force loop as hapticd does, in a thread of its own over its real channels: a simulated hand
/// presses and strokes a wall, which is modelled 30 times a second, and every tick is taken out of the ring.
/// Errors: SCHED_FIFO or the CPU is refused, a thread cannot be started, the loop hardly ticks, interrupted.
config::Result<LoopRun> runForceLoop(const LoopSetting& setting, const Interrupt& interrupt);

}  // namespace hapticd::tools
