// SPDX-License-Identifier: Apache-2.0
#include "drivers/handle/simulated/simulated_handle.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>

#include "drivers/handle/velocity_estimator.h"
#include "rt/base/clock.h"

namespace hapticd::drivers {
namespace {

void sleepUntil(std::int64_t when_ns) {
  const timespec when{when_ns / rt::kNsPerSecond, when_ns % rt::kNsPerSecond};
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &when, nullptr) == EINTR) {
  }
}

base::Result<void> requireAboveZero(const char* name, double value) {
  if (value > 0 && std::isfinite(value)) return {};
  return std::unexpected(base::Error{name, fmt::format("{} is not above 0", value), ""});
}

/// Measures exactly, or with the resolution of encoders: quantised positions, interpolated as those of a
/// device, and a velocity estimated from them.
class Encoders {
 public:
  explicit Encoders(double quantum_m) : quantum_m_(quantum_m), tracker_(quantum_m), velocity_(quantum_m) {}

  /// Fills `state`, except time_ns, which must be set already.
  void measure(const SimulatedHand& hand, rt::HandleState& state) {
    state.position_m_in_world = hand.position_m_in_world();
    state.velocity_m_per_s_in_world = hand.velocity_m_per_s_in_world();
    state.has_orientation = state.has_gripper = true;
    state.orientation_in_world = hand.orientation_in_world();
    state.gripper_rad = hand.gripper_rad();
    if (quantum_m_ <= 0) return;
    rt::Vec3& p = state.position_m_in_world;
    p = tracker_.add({rounded(p.x), rounded(p.y), rounded(p.z)}, state.time_ns);
    state.velocity_m_per_s_in_world = velocity_.add(p, state.time_ns);
  }

 private:
  double rounded(double position_m) const { return quantum_m_ * std::round(position_m / quantum_m_); }

  double quantum_m_;
  PositionTracker tracker_;
  VelocityEstimator velocity_;
};

}  // namespace

base::Result<void> SimulatedHandle::check() const {
  if (auto ok = requireAboveZero("handle mass", settings_.mass_kg); !ok) return ok;
  if (auto ok = requireAboveZero("hand stiffness", settings_.hand_stiffness_n_per_m); !ok) return ok;
  if (auto ok = requireAboveZero("stroke period", settings_.stroke_period_s); !ok) return ok;
  return requireAboveZero("length of the direction of approach", norm(settings_.direction_in_world));
}

base::Result<void> SimulatedHandle::start(HandleChannels& channels) {
  if (thread_.joinable()) return std::unexpected(base::Error{"simulated handle", "is already running", ""});
  if (auto ok = check(); !ok) return ok;
  stop_requested_ = false;
  auto started = startHandleThread(policy_, [this, &channels] { simulate(channels); });
  if (!started) return std::unexpected(started.error());
  scheduling_ = started->scheduling;
  thread_ = std::move(started->thread);
  running_ = true;
  return {};
}

void SimulatedHandle::stop() {
  stop_requested_ = true;
  if (thread_.joinable()) thread_.join();
  running_ = false;
}

HandleStatus SimulatedHandle::status() const {
  const bool running = running_;
  HandleStatus status;
  status.state = running ? HandlePresence::present : HandlePresence::absent;
  status.detail = running ? "" : "not started";
  status.identity = "simulated";
  status.measurements = measurements_.load(std::memory_order_relaxed);
  status.scheduling = scheduling_;
  status.last_hop = gate_.lastHop();
  return status;
}

void SimulatedHandle::simulate(HandleChannels& channels) {
  constexpr std::uint64_t kSession = 1;
  constexpr double kStepS = static_cast<double>(kStepNs) / static_cast<double>(rt::kNsPerSecond);
  SimulatedHand hand(settings_, kStepS);
  Encoders encoders(settings_.position_quantum_m);
  std::uint64_t sequence = 0;
  std::int64_t due_ns = rt::monotonicNow_ns();
  while (!stop_requested_.load(std::memory_order_relaxed)) {
    sleepUntil(due_ns);
    const std::int64_t steps = std::max<std::int64_t>(1, (rt::monotonicNow_ns() - due_ns) / kStepNs + 1);
    due_ns += steps * kStepNs;

    if (settings_.follows_person && channels.hand_target_m_in_world.refresh())
      hand.lead(channels.hand_target_m_in_world.front());
    channels.command.refresh();
    const std::int64_t now_ns = rt::monotonicNow_ns();
    const rt::Vec3 force = gate_.pass(channels.command.front(), kSession, now_ns).value_or(rt::Vec3{});
    gate_.sent(now_ns);
    exerted_force_n_.store(norm(force), std::memory_order_relaxed);
    for (std::int64_t step = 0; step < std::min(steps, kMaxStepsAtOnce); ++step) hand.step(force);

    rt::HandleState state;
    state.time_ns = rt::monotonicNow_ns();
    encoders.measure(hand, state);
    state.sequence = ++sequence;
    state.session = kSession;
    state.command_latency_ns = gate_.latency_ns();
    channels.state.write(state);
    measurements_.store(sequence, std::memory_order_relaxed);
  }
  exerted_force_n_.store(0, std::memory_order_relaxed);
}

std::unique_ptr<Handle> makeSimulatedHandle(const config::HandleSettings& settings,
                                            const rt::HandleScaleParameters& /*scale*/,
                                            const HandleThreadPolicy& policy) {
  return std::make_unique<SimulatedHandle>(settings.of<SimulatedHandleSettings>(), policy);
}

}  // namespace hapticd::drivers
