// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hapticd::rt {

/// Locks all present and future memory of the process, if that cannot make a later allocation fail: only with
/// CAP_IPC_LOCK or without a limit on locked memory. True if done.  RT: not safe.
bool lockMemory() noexcept;

/// Gives the calling thread SCHED_FIFO at `priority`; true if permitted.  RT: not safe.
bool useRealtimeScheduling(int priority) noexcept;

/// Pins the calling thread to `cpu`, or for -1 to the last CPU that the process may use. Returns the CPU, or
/// -1 if that was not possible.  RT: not safe.
int pinToCpu(int cpu) noexcept;

/// Touches the calling thread's stack, so that its pages are there when it is used.  RT: not safe.
void prefaultStack() noexcept;

}  // namespace hapticd::rt
