// SPDX-License-Identifier: Apache-2.0
#include "rt/loop/force_loop.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "rt/base/realtime_thread.h"
#include "rt/loop/warm_up.h"

namespace hapticd::rt {

ForceLoop::ForceLoop(const LoopParameters& parameters, const StartParameters& start,
                     std::size_t point_capacity, const ForceLoopChannels& channels)
    : parameters_(parameters),
      start_(start),
      channels_(channels),
      point_capacity_(point_capacity),
      core_(point_capacity),
      clock_(std::llround(1e9 / parameters.rate_hz)),
      period_s_(1 / parameters.rate_hz) {}

LoopPrivileges ForceLoop::prepare() {
  LoopPrivileges privileges;
  useDefaultFloatingPoint();
  privileges.cpu = pinToCpu(parameters_.cpu);
  privileges.realtime_scheduling = useRealtimeScheduling(parameters_.priority);
  prefaultStack();
  warmUp(core_, point_capacity_);
  constexpr int kWarmUpTicks = 10;
  for (int i = 0; i < kWarmUpTicks; ++i) {
    const std::int64_t now_ns = monotonicNow_ns();
    core_.step({now_ns, period_s_, channels_.scenes.front(), channels_.handle_state.front(),
                channels_.control.directive.front(), start_});
  }
  return privileges;
}

void ForceLoop::run() HAPTICD_RT {
  clock_.start(monotonicNow_ns());
  do {
    sleepUntil(clock_.planned_ns());
    const std::int64_t woke_ns = monotonicNow_ns();
    lookForStop();
    tick(clock_.planned_ns(), woke_ns);
  } while (!hasStopped());
}

void ForceLoop::lookForStop() HAPTICD_RT {
  if (stopping_ || !stop_.load(std::memory_order_relaxed)) return;
  stopping_ = true;
  stop_bound_.begin(state_.tick.command_force_n_in_world,
                    channels_.control.directive.front().parameters.safety, period_s_, clock_.planned_ns());
}

void ForceLoop::tick(std::int64_t planned_ns, std::int64_t woke_ns) HAPTICD_RT {
  channels_.scenes.refresh();
  channels_.handle_state.refresh();
  channels_.control.directive.refresh();
  channels_.control.fixtures.refresh();
  channels_.control.tissue.refresh();
  channels_.control.external_force.refresh();
  const HandleState& handle = channels_.handle_state.front();
  Directive directive = channels_.control.directive.front();
  if (stopping_) directive.engage = false;

  answerSnapshotRequest();
  const bool release = stopping_ && stop_bound_.releases(planned_ns);
  std::array<FramePose, kMaxPosesPerTick> poses;
  std::size_t pose_count = 0;
  while (pose_count < poses.size() && channels_.control.frame_poses.pop(poses[pose_count])) ++pose_count;
  Tick tick =
      core_.step({.now_ns = woke_ns,
                  .period_s = period_s_,
                  .scene = channels_.scenes.front(),
                  .handle = handle,
                  .directive = directive,
                  .start = start_,
                  .overran = overran_,
                  .release = release,
                  .fixtures = &channels_.control.fixtures.front(),
                  .tissue = &channels_.control.tissue.front(),
                  .poses = std::span(poses).first(pose_count),
                  .external_n_in_world = externalForceAt(channels_.control.external_force.front(), woke_ns)});
  tick.number = state_.counters.ticks + 1;
  tick.stopping = stopping_;
  tick.planned_ns = planned_ns;
  tick.trace_dropped = channels_.control.trace.dropped();
  tick.wakeup_latency_ns = woke_ns - planned_ns;
  channels_.handle_command.write({tick.command_force_n_in_world, tick.number, handle.session,
                                  monotonicNow_ns(), woke_ns, tick.contact_damping_n_s_per_m});
  channels_.focus.write(core_.focus_m_in_world(handle.position_m_in_world));

  if (channels_.stall_ns != nullptr) stall(woke_ns);
  const std::int64_t done_ns = monotonicNow_ns();
  tick.compute_ns = done_ns - woke_ns;
  const std::uint64_t skipped = clock_.advance(done_ns);
  overran_ = skipped != 0;
  state_.counters.overruns += overran_ ? 1 : 0;
  state_.counters.skipped_periods += skipped;
  state_.directive_generation = directive.generation;
  state_.stiffness_rules = core_.stiffnessRules();
  state_.latency = core_.latency();
  const std::size_t fixtures = channels_.control.fixtures.front().count;
  for (std::size_t i = 0; i < fixtures; ++i) state_.fixtures[i] = core_.fixture(i);
  const std::size_t frames = channels_.control.fixtures.front().frame_count;
  for (std::size_t i = 0; i < frames; ++i) state_.frames[i] = core_.frame(i);
  noteTransition(tick, woke_ns);
  count(tick);
  publish(tick);
}

void ForceLoop::answerSnapshotRequest() HAPTICD_RT {
  if (channels_.core_memory == nullptr) return;
  const std::uint64_t request = channels_.core_memory->request.load(std::memory_order_relaxed);
  if (request == snapshot_request_) return;
  snapshot_request_ = request;
  channels_.core_memory->snapshot.write({request, state_.counters.ticks + 1, core_.memory()});
}

/// Busy-waits, for at most kMaxStall_ns.
void ForceLoop::stall(std::int64_t since_ns) const HAPTICD_RT {
  const std::int64_t requested_ns = channels_.stall_ns->load(std::memory_order_relaxed);
  if (requested_ns <= 0 || state_.counters.ticks % 2 == 0) return;
  const std::int64_t end_ns = since_ns + std::min(requested_ns, kMaxStall_ns);
  while (monotonicNow_ns() < end_ns) {
  }
}

/// Records a change of mode or cause since the previous tick, which is still in the state.
void ForceLoop::noteTransition(const Tick& tick, std::int64_t now_ns) HAPTICD_RT {
  const Tick& before = state_.tick;
  if (tick.mode == before.mode && tick.cause == before.cause) return;
  const Transition transition{state_.transition_count + 1, now_ns, before.mode, tick.mode, tick.cause};
  state_.transition_count = transition.number;
  state_.transitions[transition.number % kTransitionsKept] = transition;
  ++state_.transitions_by_cause[static_cast<std::size_t>(tick.cause)];
}

void ForceLoop::count(const Tick& tick) HAPTICD_RT {
  LoopCounters& counters = state_.counters;
  const auto add = [](std::uint64_t& counter, bool acted) { counter += acted ? 1 : 0; };
  ++counters.ticks;
  add(counters.contact_ticks, inContact(tick));
  add(counters.outside_model_ticks, tick.outside_model);
  add(counters.slew_limited_ticks, tick.slew_limited);
  add(counters.magnitude_clamped_ticks, tick.magnitude_clamped);
  add(counters.not_finite_ticks, tick.not_finite);
  add(counters.depth_stale_ticks, tick.mode == Mode::holding && tick.cause == Cause::depth_stale);
  add(counters.handle_stale_ticks, tick.mode == Mode::holding && tick.cause == Cause::handle_stale);
  add(counters.handle_invalid_ticks, tick.mode == Mode::holding && tick.cause == Cause::handle_invalid);
  add(counters.passivity_ticks, tick.passivity_acted);
  add(counters.thermally_limited_ticks, tick.thermally_limited);
  add(counters.stiffness_limited_ticks, tick.stiffness_gain < 1);
  add(counters.releases, tick.released && !state_.tick.released);
}

void ForceLoop::publish(const Tick& tick) HAPTICD_RT {
  state_.tick = tick;
  channels_.control.state.write(state_);
  channels_.control.ticks.push(tick);
  channels_.control.trace.push(tick);
  channels_.control.wakeup_latency.add(tick.wakeup_latency_ns);
  channels_.control.compute_time.add(tick.compute_ns);
}

bool ForceLoop::hasStopped() const HAPTICD_RT {
  return stopping_ && (state_.tick.command_force_n_in_world == Vec3{} || stop_bound_.isOver());
}

}  // namespace hapticd::rt
