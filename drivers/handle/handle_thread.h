// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <thread>

#include "config/error.h"
#include "config/settings.h"
#include "drivers/handle/handle.h"
#include "rt/parameters.h"

namespace hapticd::drivers {

/// How a handle's thread is to be scheduled.
struct HandleThreadPolicy {
  int priority = 0;      ///< SCHED_FIFO; 0: as all other threads
  int avoided_cpu = -1;  ///< left to the force thread; -1: none
};

/// handle.thread_priority, or what the driver needs: a thread that carries forces is second to the force
/// thread alone, one below loop.priority; that of a device without motors is one among others.
/// `isolated_cpu`: that the kernel keeps free for the force thread, -1: none.
HandleThreadPolicy handleThreadPolicy(const config::HandleSettings& settings, const rt::LoopParameters& loop,
                                      int isolated_cpu);

struct HandleThread {
  std::thread thread;
  HandleScheduling scheduling;
};

/// Runs `body` in a thread that is scheduled as far as this process may.
/// Errors: the system gives no more threads.
config::Result<HandleThread> startHandleThread(const HandleThreadPolicy& policy, std::function<void()> body);

}  // namespace hapticd::drivers
