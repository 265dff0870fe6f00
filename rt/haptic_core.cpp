#include "rt/haptic_core.h"

#include <algorithm>
#include <cmath>

namespace hapticd::rt {
namespace {

/// While the HIP's neighbourhood is not modelled the last force is held that long; a new model of the same
/// frame takes the scene thread far less.
constexpr double kMaxHold_s = 0.01;

bool isOlder(std::int64_t time_ns, std::int64_t now_ns, double limit_s) noexcept {
  return static_cast<double>(now_ns - time_ns) > limit_s * 1e9;
}

/// What keeps the loop from commanding a force, or `none`.
Cause obstacleOf(const HapticCore::Input& input) HAPTICD_RT {
  const SafetyParameters& limits = input.directive.parameters.safety;
  if (input.handle.sequence == 0 || isOlder(input.handle.time_ns, input.now_ns, limits.handle_timeout_s)) {
    return Cause::handle_stale;
  }
  if (!inWorkspace(input.handle.position_m_in_world)) return Cause::handle_invalid;
  if (input.scene.frame == 0) return Cause::no_scene;
  if (isOlder(input.scene.frame_time_ns, input.now_ns, limits.depth_timeout_s)) return Cause::depth_stale;
  return Cause::none;
}

}  // namespace

ForceSample HapticCore::lawForce(const Scene& scene, const Vec3& hip_m_in_world,
                                 const LiveParameters& parameters) HAPTICD_RT {
  return laws_.force({scene, hip_m_in_world, {}, parameters});
}

void HapticCore::decideMode(const Input& input, Cause obstacle) HAPTICD_RT {
  if (!input.directive.engage) {  // also what clears a fault
    if (mode_ != Mode::idle) cause_ = mode_ == Mode::starting ? Cause::none : Cause::requested;
    mode_ = Mode::idle;
    return;
  }
  if (mode_ == Mode::faulted) return;
  if (obstacle != Cause::none) {
    mode_ = Mode::holding;
    cause_ = obstacle;
    return;
  }
  if (mode_ != Mode::engaged) engaged_s_ = 0;
  mode_ = Mode::engaged;
  cause_ = Cause::requested;
}

double HapticCore::rampGain(const Input& input) HAPTICD_RT {
  engaged_s_ += input.period_s;
  const double ramp_s = input.directive.parameters.safety.engage_ramp_s;
  return engaged_s_ >= ramp_s ? 1.0 : engaged_s_ / ramp_s;
}

/// The law's force at the handle, or the held one for a moment where the scene is not modelled.
Vec3 HapticCore::feel(const Input& input, Tick& tick) HAPTICD_RT {
  const ForceSample sample =
      laws_.force({input.scene, input.handle.position_m_in_world, input.handle.velocity_m_per_s_in_world,
                   input.directive.parameters});
  tick.law = laws_.law();
  tick.contact = sample.state;
  tick.proxy_m_in_world = sample.proxy_m_in_world;
  tick.outside_model = sample.outside_model;
  if (sample.outside_model) {
    outside_model_s_ += input.period_s;
    if (outside_model_s_ > kMaxHold_s) held_force_n_in_world_ = {};
    return held_force_n_in_world_;
  }
  outside_model_s_ = 0;
  tick.points_used = sample.points_used;
  tick.law_force_n_in_world = sample.force_n_in_world;
  held_force_n_in_world_ = isFinite(sample.force_n_in_world) ? sample.force_n_in_world : Vec3{};
  return sample.force_n_in_world;
}

/// How much more the force of a law with a proxy changed than the HIP's own way explains: the surface moved,
/// or the proxy is still on its way after it, or slipped off an edge.
double HapticCore::unexplained_n(const Input& input, const Vec3& force_n_in_world) const HAPTICD_RT {
  if (!hasProxy(laws_.law())) return 0;
  const LiveParameters& parameters = input.directive.parameters;
  const double way_m = norm(input.handle.position_m_in_world - before_.hip_m_in_world);
  const double speed_change =
      norm(input.handle.velocity_m_per_s_in_world - before_.velocity_m_per_s_in_world);
  const double explained_n =
      parameters.springs.stiffness_n_per_m * way_m + parameters.contact.damping_n_s_per_m * speed_change;
  return std::max(0.0, norm(force_n_in_world - before_.force_n_in_world) - explained_n);
}

/// Carries the force over a change of scene, law or parameters. It is cut to the limit first, so that what is
/// carried over is never more than the handle could have felt.
Vec3 HapticCore::blend(const Input& input, const Vec3& force_n_in_world, Tick& tick) HAPTICD_RT {
  const LiveParameters& parameters = input.directive.parameters;
  const double length = norm(force_n_in_world);
  const double limit = parameters.safety.max_force_n;
  const Vec3 cut =
      std::isfinite(length) && length > limit ? (limit / length) * force_n_in_world : force_n_in_world;
  const Origin now{input.scene.model, laws_.law(), parameters.springs, parameters.contact,
                   tick.outside_model};
  const double most_n =
      parameters.springs.stiffness_n_per_m * parameters.blend.max_surface_speed_m_per_s * input.period_s;
  const double unexplained = unexplained_n(input, cut);
  const bool changed = origin_.model != 0 && (now != origin_ || unexplained > most_n);
  origin_ = now;
  before_ = {input.handle.position_m_in_world, input.handle.velocity_m_per_s_in_world, cut};
  const Vec3 blended = blend_.apply(cut, changed, parameters.blend, parameters.springs.stiffness_n_per_m,
                                    input.period_s, changed ? 0 : unexplained);
  tick.blending = !(blended == cut);
  tick.blended_force_n_in_world = blended;
  return blended;
}

Tick HapticCore::step(const Input& input) HAPTICD_RT {
  Tick tick;
  const Cause obstacle = obstacleOf(input);
  decideMode(input, obstacle);
  tick.hip_m_in_world = input.handle.position_m_in_world;
  tick.proxy_m_in_world = tick.hip_m_in_world;
  tick.scene_frame = input.scene.frame;
  tick.scene_age_ns = input.scene.frame == 0 ? 0 : input.now_ns - input.scene.frame_time_ns;

  // The law is felt in every mode whose inputs are good, so that status shows contact before engaging.
  Vec3 aim;
  if (obstacle == Cause::none) {
    const Vec3 felt = blend(input, feel(input, tick), tick);
    if (mode_ == Mode::engaged) aim = rampGain(input) * felt;
  } else {
    laws_.release();  // where the proxy is has no meaning any more
    blend_.reset();
    origin_ = {};
  }
  const SafetyChain::Output out = safety_.apply(aim, input.directive.parameters.safety, input.period_s);
  if (out.not_finite) {
    mode_ = Mode::faulted;
    cause_ = Cause::force_not_finite;
    held_force_n_in_world_ = {};
  }
  tick.mode = mode_;
  tick.cause = cause_;
  tick.slew_limited = out.slew_limited;
  tick.magnitude_clamped = out.magnitude_clamped;
  tick.not_finite = out.not_finite;
  tick.command_force_n_in_world = out.force_n_in_world;
  return tick;
}

}  // namespace hapticd::rt
