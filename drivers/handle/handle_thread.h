// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <thread>

#include "config/base/error.h"
#include "config/settings/settings.h"
#include "drivers/handle/handle.h"
#include "rt/base/parameters.h"

namespace hapticd::drivers {

/// Requested scheduling of a handle's thread.
struct HandleThreadPolicy {
  int priority = 0;      ///< SCHED_FIFO priority; 0: normal scheduling
  int avoided_cpu = -1;  ///< left to the force thread; -1: none
};

/// Returns what the driver needs: a thread that carries forces runs one below loop.priority, second only to
/// the force thread; that of a device without motors runs with normal scheduling. `isolated_cpu`: the CPU
/// that the kernel keeps free for the force thread; -1: none.
HandleThreadPolicy handleThreadPolicy(const config::HandleSettings& settings, const rt::LoopParameters& loop,
                                      int isolated_cpu);

/// A started handle thread and the scheduling that it obtained.
struct HandleThread {
  std::thread thread;
  HandleScheduling scheduling;
};

/// Runs `body` in a thread that is scheduled as far as permitted.
/// Errors: the system limit on threads is reached.
base::Result<HandleThread> startHandleThread(const HandleThreadPolicy& policy,
                                             std::move_only_function<void()> body);

}  // namespace hapticd::drivers
