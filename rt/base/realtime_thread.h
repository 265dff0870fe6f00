// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace hapticd::rt {

/// Locks all present and future memory of the process, provided that this cannot make a later allocation
/// fail: only with CAP_IPC_LOCK or without a limit on locked memory. Returns true if locked.  RT: not safe.
bool lockMemory() noexcept;

/// Size of the stack of every thread but the main one. The deepest stack is that of a configuration with 500
/// nested maps, where yaml-cpp stops: 200 KB.
inline constexpr std::size_t kThreadStackBytes = 384 * 1024;

/// Gives all threads created from now on stacks of kThreadStackBytes, also those that a library creates.
/// Locked memory makes a stack resident as a whole, and the default is the limit of the main thread's, 8 MB
/// as a rule.  Thread: before others exist.  RT: not safe.
void limitThreadStacks() noexcept;

/// Returns the whole pages of a piece of memory that is not in use to the system, also if they are locked.
/// They come back, as zeros and not locked, when they are touched: not for memory that the force thread
/// reads. RT: not safe.
void returnPages(void* begin, std::size_t bytes) noexcept;

/// Gives the calling thread SCHED_FIFO at `priority` (1..99); returns true if permitted.  RT: not safe.
bool useRealtimeScheduling(int priority) noexcept;

/// Pins the calling thread to `cpu`, or with -1 to the last CPU available to the process. Returns that CPU,
/// or -1 if pinning failed.  RT: not safe.
int pinToCpu(int cpu) noexcept;

/// Gives the calling thread the default floating-point environment: rounding to nearest, and subnormal
/// numbers are kept, on every processor. A thread starts with the environment of its creator, which a library
/// that was linked with -ffast-math has set to flush subnormal numbers to zero for the whole process.  RT:
/// safe.
void useDefaultFloatingPoint() noexcept;

/// Touches the calling thread's stack, so that its pages are present when used.  RT: not safe.
void prefaultStack() noexcept;

}  // namespace hapticd::rt
