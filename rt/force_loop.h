// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "rt/haptic_core.h"
#include "rt/loop_state.h"
#include "rt/periodic_clock.h"
#include "rt/realtime_thread.h"
#include "rt/stop_bound.h"
#include "rt/triple_buffer.h"

namespace hapticd::rt {

/// What the core remembered before a tick; from there on the ticks can be computed again.
struct CoreSnapshot {
  std::uint64_t request = 0;  ///< the one that it answers
  std::uint64_t tick = 0;     ///< number of the tick that it was taken before
  HapticCore::Memory memory;
};

/// Snapshots of the core's memory, taken on request.
struct CoreMemoryChannel {
  std::atomic<std::uint64_t> request{0};  ///< trace thread: +1 asks for one; relaxed: it orders nothing
  TripleBuffer<CoreSnapshot> snapshot;    ///< force thread writes
};

/// The channels that the force loop reads and writes; all outlive it.
struct ForceLoopChannels {
  SceneChannel& scenes;                  ///< reads
  HandleStateChannel& handle_state;      ///< reads
  HandleCommandChannel& handle_command;  ///< writes
  TripleBuffer<Vec3>& focus;             ///< writes: where the scene thread is to model
  ControlChannels& control;              ///< reads directives, writes the rest
  /// Fault injection, normally null: every second tick takes that much longer, at most kLongestStall_ns.
  const std::atomic<std::int64_t>* stall_ns = nullptr;
  /// Where snapshots are asked for and go; null: nobody asks.
  CoreMemoryChannel* core_memory = nullptr;
};

inline constexpr std::int64_t kLongestStall_ns = 20'000'000;

/// The 1 kHz loop: one HapticCore step per period of a fixed grid of CLOCK_MONOTONIC times.
/// While it runs it allocates nothing, takes no lock, makes no system call but reading and sleeping on the
/// clock, and waits for nobody.
class ForceLoop {
 public:
  /// `point_capacity`: of the scenes in the channel.
  ForceLoop(const LoopParameters& parameters, std::size_t point_capacity, const ForceLoopChannels& channels);

  /// Sets the calling thread up for real time, as far as it is permitted: pinned CPU, SCHED_FIFO, prefaulted
  /// stack; and runs the cycle on made-up input, so that its code and memory have been touched.
  /// Thread: the force thread, once, before run().  RT: not safe.
  LoopPrivileges prepare();

  /// Ticks until requestStop(), then for as long as it takes the commanded force to reach zero, but no longer
  /// than a StopBound allows.
  /// Thread: the force thread.
  void run() HAPTICD_RT;

  /// Thread: any.  RT: safe.
  void requestStop() HAPTICD_RT { stop_.store(true, std::memory_order_relaxed); }

 private:
  void tick(std::int64_t planned_ns, std::int64_t woke_ns) HAPTICD_RT;
  void publish(const Tick& tick) HAPTICD_RT;
  void answerSnapshotRequest() HAPTICD_RT;
  void stall(std::int64_t since_ns) const HAPTICD_RT;
  void noteTransition(const Tick& tick, std::int64_t now_ns) HAPTICD_RT;
  void count(const Tick& tick) HAPTICD_RT;
  void lookForStop() HAPTICD_RT;
  bool hasStopped() const HAPTICD_RT;

  LoopParameters parameters_;
  ForceLoopChannels channels_;
  std::size_t point_capacity_;
  HapticCore core_;
  PeriodicClock clock_;
  double period_s_;
  std::atomic<bool> stop_{false};  // relaxed: a flag, it orders nothing
  bool stopping_ = false;
  StopBound stop_bound_;
  bool overran_ = false;                ///< the tick before ended late
  std::uint64_t snapshot_request_ = 0;  ///< the last one that was answered
  LoopState state_;
};

}  // namespace hapticd::rt
