// SPDX-License-Identifier: Apache-2.0
#include "rt/loop/supervisor.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace hapticd::rt {
namespace {

/// Tolerated excess displacement: the device's clock and ours may differ when several measurements arrive at
/// once.
constexpr double kLeap_m = 0.01;
/// Time for which a handle is ignored after an impossible displacement.
constexpr std::int64_t kDistrust_ns = 100'000'000;
/// Time without a burst after which the loop counts as punctual again.
constexpr std::int64_t kOverrunPause_ns = 1'000'000'000;
/// A device that has contradicted itself for this long holds the force at zero ...
constexpr double kLastingContradiction_s = 0.2;
/// ... until it has not for this long.
constexpr std::int64_t kConsistent_ns = 1'000'000'000;

bool isOlder(std::int64_t time_ns, std::int64_t now_ns, double limit_s) noexcept {
  return static_cast<double>(now_ns - time_ns) > limit_s * 1e9;
}

Cause conditionOf(const HandleState& handle) noexcept {
  switch (handle.condition) {
    case HandleCondition::ready:
      return Cause::none;
    case HandleCondition::clutched:
      return Cause::handle_clutched;
    case HandleCondition::not_calibrated:
      break;
  }
  return Cause::handle_not_calibrated;
}

}  // namespace

/// Returns whether the hand moved impossibly far since the previous measurement of the same session.
bool Supervisor::isTooFast(const Input& input) HAPTICD_RT {
  const HandleState& now = input.handle;
  const HandleState before = last_handle_;
  if (now.sequence == before.sequence) return input.now_ns < too_fast_until_ns_;
  last_handle_ = now;
  const SafetyParameters& limits = input.directive.parameters.safety;
  const bool comparable = limits.max_handle_speed_m_per_s > 0 && before.sequence != 0 &&
                          before.session == now.session && before.condition == HandleCondition::ready &&
                          now.condition == HandleCondition::ready && inWorkspace(before.position_m_in_world);
  if (comparable) {
    const double displacement_m =
        norm(now.position_m_in_world - before.position_m_in_world) / input.start.handle.motion_scale;
    const double time_s = std::max(static_cast<double>(now.time_ns - before.time_ns) * 1e-9, 0.0);
    if (displacement_m > limits.max_handle_speed_m_per_s * time_s + kLeap_m) {
      too_fast_until_ns_ = input.now_ns + kDistrust_ns;
    }
  }
  return input.now_ns < too_fast_until_ns_;
}

/// Returns whether the device goes on claiming what it does not do.
bool Supervisor::isInconsistent(const Input& input) HAPTICD_RT {
  if (input.handle.velocity_claim == VelocityClaim::contradicted) {
    contradicting_s_ += input.period_s;
    contradicted_ns_ = input.now_ns;
  } else if (input.now_ns - contradicted_ns_ > kConsistent_ns) {
    contradicting_s_ = 0;
  }
  return contradicting_s_ > kLastingContradiction_s;
}

/// Returns the fault of the handle's measurements, or `none`.
Cause Supervisor::handleFault(const Input& input) HAPTICD_RT {
  const HandleState& handle = input.handle;
  if (handle.sequence == 0 ||
      isOlder(handle.time_ns, input.now_ns, input.directive.parameters.safety.handle_timeout_s)) {
    return Cause::handle_stale;
  }
  if (!inWorkspace(handle.position_m_in_world) || !isFinite(handle.velocity_m_per_s_in_world)) {
    last_handle_ = {};
    return Cause::handle_invalid;
  }
  return isTooFast(input) ? Cause::handle_too_fast : Cause::none;
}

bool Supervisor::isOverrunning(const Input& input) HAPTICD_RT {
  overruns_ = overruns_ << 1U | (input.overran ? 1U : 0U);
  if (std::popcount(overruns_) >= input.directive.parameters.safety.overrun_burst)
    overrunning_until_ns_ = input.now_ns + kOverrunPause_ns;
  return input.now_ns < overrunning_until_ns_;
}

Supervisor::Obstacle Supervisor::look(const Input& input) HAPTICD_RT {
  const bool overrunning = isOverrunning(input);
  const bool inconsistent = isInconsistent(input);
  if (input.handle.sequence != 0 && input.handle.session != session_) {
    session_changed_ = session_ != 0;
    session_ = input.handle.session;
  }
  const Cause handle_fault = handleFault(input);
  if (handle_fault != Cause::none || input.release) return {handle_fault, false, true};
  const SafetyParameters& limits = input.directive.parameters.safety;
  if (const Cause condition = conditionOf(input.handle); condition != Cause::none) return {condition, false};
  if (input.scene.frame == 0) return {Cause::no_scene, false};
  if (norm(input.handle.position_m_in_world) > limits.workspace_radius_m) {
    return {Cause::outside_workspace};
  }
  if (overrunning) return {Cause::overrun_burst};
  if (inconsistent) return {Cause::handle_inconsistent};
  if (isOlder(input.scene.frame_time_ns, input.now_ns, limits.depth_timeout_s)) return {Cause::depth_stale};
  return {};
}

/// Returns whether the surface in contact has been nearer than the camera can measure for so long that its
/// last seen position is no longer meaningful.
bool Supervisor::isTooNear(const Input& input, const Contact& contact) HAPTICD_RT {
  if (contact.too_near && !was_too_near_) too_near_since_ns_ = input.now_ns;
  was_too_near_ = contact.too_near;
  return contact.too_near &&
         isOlder(too_near_since_ns_, input.now_ns, input.directive.parameters.safety.depth_timeout_s);
}

void Supervisor::refuse(Cause cause) HAPTICD_RT {
  refused_ = true;
  mode_ = Mode::idle;
  cause_ = cause;
}

void Supervisor::engageOrRefuse(const Input& input, bool in_contact) HAPTICD_RT {
  if (!accepted_ && in_contact && !input.directive.engage_inside &&
      !input.directive.parameters.safety.engage_inside) {
    refuse(Cause::inside_surface);
    return;
  }
  accepted_ = true;
  mode_ = Mode::engaged;
  cause_ = Cause::requested;
}

/// Returns whether the box stays engaged although depth is lost, because fixtures act that need none.
bool Supervisor::goesOnWithoutDepth(const Obstacle& obstacle, bool too_near,
                                    const Contact& contact) const HAPTICD_RT {
  const bool stale = obstacle.cause == Cause::depth_stale;
  const bool only_depth = stale || (obstacle.cause == Cause::none && too_near);
  return only_depth && contact.keeps && accepted_ && !contact.in_debt;
}

void Supervisor::decide(const Input& input, const Obstacle& obstacle, const Contact& contact) HAPTICD_RT {
  const Directive& directive = input.directive;
  const bool replaced = std::exchange(session_changed_, false);
  const bool too_near = isTooNear(input, contact);
  if (!directive.engage || directive.engage_request != request_) {
    request_ = directive.engage_request;
    accepted_ = false;
    refused_ = false;
  }
  without_depth_ = false;
  if (!directive.engage) {  // also clears a fault
    if (mode_ != Mode::idle) cause_ = mode_ == Mode::starting ? Cause::none : Cause::requested;
    mode_ = Mode::idle;
  } else if (mode_ != Mode::faulted && !refused_) {
    if (replaced && accepted_) {
      refuse(Cause::handle_replaced);
    } else if (goesOnWithoutDepth(obstacle, too_near, contact)) {
      without_depth_ = true;
      mode_ = Mode::engaged;
      cause_ = too_near ? Cause::surface_too_near : Cause::depth_stale;
    } else if (obstacle.cause != Cause::none) {
      mode_ = Mode::holding;
      cause_ = obstacle.cause;
    } else if (too_near) {
      mode_ = Mode::holding;
      cause_ = Cause::surface_too_near;
    } else if (contact.in_debt) {
      mode_ = Mode::holding;
      cause_ = Cause::energy_debt;
    } else {
      engageOrRefuse(input, contact.in_contact);
    }
  }
  moveGain(input, obstacle);
}

void Supervisor::moveGain(const Input& input, const Obstacle& obstacle) HAPTICD_RT {
  const SafetyParameters& limits = input.directive.parameters.safety;
  // Fades out by the clock, even if ticks are skipped; ramps in by the ticks that were executed.
  const double elapsed_s = std::max(input.period_s, static_cast<double>(input.now_ns - last_ns_) * 1e-9);
  last_ns_ = input.now_ns;
  if (mode_ == Mode::engaged) {
    gain_ = std::min(1.0, gain_ + input.period_s / limits.engage_ramp_s);
  } else if (mode_ == Mode::holding && obstacle.law_usable) {
    gain_ = std::max(0.0, gain_ - elapsed_s / limits.depth_ramp_s);
  } else {
    gain_ = 0;
  }
  if (without_depth_) {
    depth_share_ = std::max(0.0, depth_share_ - elapsed_s / limits.depth_ramp_s);
  } else if (gain_ > 0) {
    depth_share_ = std::min(1.0, depth_share_ + input.period_s / limits.engage_ramp_s);
  } else {
    depth_share_ = 1;
  }
}

}  // namespace hapticd::rt
