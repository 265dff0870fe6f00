// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "rt/base/clock.h"
#include "rt/base/realtime_thread.h"
#include "rt/channels/triple_buffer.h"
#include "rt/loop/haptic_core.h"
#include "rt/loop/loop_state.h"
#include "rt/loop/stop_bound.h"

namespace hapticd::rt {

/// The core's memory before a tick; replaying the following ticks from it gives the same forces.
struct CoreSnapshot {
  std::uint64_t request = 0;  ///< number of the request that it answers
  std::uint64_t tick = 0;     ///< number of the tick before which it was taken
  HapticCore::Memory memory;
};

/// Channel for snapshots of the core's memory, taken on request.
struct CoreMemoryChannel {
  /// The trace thread increments it to request one; relaxed: orders nothing.
  std::atomic<std::uint64_t> request{0};
  TripleBuffer<CoreSnapshot> snapshot;  ///< written by the force thread
};

/// The channels of the force loop; all outlive it.
struct ForceLoopChannels {
  SceneChannel& scenes;                  ///< read
  HandleStateChannel& handle_state;      ///< read
  HandleCommandChannel& handle_command;  ///< written
  TripleBuffer<Vec3>& focus;             ///< written: where the scene thread is to model
  ControlChannels& control;              ///< directives are read, the rest is written
  /// Fault injection, normally null: every second tick takes this much longer, at most kMaxStall_ns.
  const std::atomic<std::int64_t>* stall_ns = nullptr;
  /// Channel for snapshots of the core's memory; null: none are taken.
  CoreMemoryChannel* core_memory = nullptr;
};

/// Longest injected stall of a tick.
inline constexpr std::int64_t kMaxStall_ns = 20'000'000;

/// The 1 kHz loop: one HapticCore step per period of a fixed grid of CLOCK_MONOTONIC times. While it runs it
/// does not allocate, takes no lock, makes no system call except reading and sleeping on the clock, and waits
/// for no other thread.
class ForceLoop {
 public:
  /// `point_capacity`: capacity of the scenes in the channel.  RT: not safe (allocates).
  ForceLoop(const LoopParameters& parameters, const StartParameters& start, std::size_t point_capacity,
            const ForceLoopChannels& channels);

  /// Prepares the calling thread for real time as far as permitted: default floating-point environment,
  /// pinned CPU, SCHED_FIFO, prefaulted stack. Then runs ticks on synthetic input to touch their code and
  /// memory. Returns what could be set up. Thread: the force thread, once, before run().  RT: not safe.
  LoopPrivileges prepare();

  /// Ticks until requestStop(), and then until the commanded force has reached zero, but no longer than
  /// StopBound allows.
  /// Thread: the force thread.
  void run() HAPTICD_RT;

  /// Asks run() to end.  Thread: any.  RT: safe.
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
  StartParameters start_;
  ForceLoopChannels channels_;
  std::size_t point_capacity_;
  HapticCore core_;
  PeriodicClock clock_;
  double period_s_;
  std::atomic<bool> stop_{false};  // relaxed: a flag, orders nothing
  bool stopping_ = false;
  StopBound stop_bound_;
  bool overran_ = false;                ///< the previous tick ended late
  std::uint64_t snapshot_request_ = 0;  ///< the last one answered
  LoopState state_;
};

}  // namespace hapticd::rt
