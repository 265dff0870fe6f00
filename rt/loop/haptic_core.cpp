// SPDX-License-Identifier: Apache-2.0
#include "rt/loop/haptic_core.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rt/laws/law_table.h"
#include "rt/safety/stiffness_limit.h"

namespace hapticd::rt {
namespace {

/// While the HIP's neighbourhood is not modelled, the last force is held for this long; the scene thread
/// takes far less to model the same frame again.
constexpr double kMaxHold_s = 0.01;
/// Displacement of the HIP over which the proxy of a law is compared: the law leaves up to a tenth of it
/// undone.
constexpr double kLearned_m = 2e-4;

}  // namespace

ForceSample HapticCore::lawForce(const Scene& scene, const Vec3& hip_m_in_world,
                                 const LiveParameters& parameters, double frame_age_s) HAPTICD_RT {
  return laws_.force({.scene = scene,
                      .hip_m_in_world = hip_m_in_world,
                      .hip_velocity_m_per_s_in_world = {},
                      .parameters = parameters,
                      .stiffness_n_per_m = parameters.force.stiffness_n_per_m,
                      .friction = parameters.contact.friction,
                      .frame_age_s = frame_age_s});
}

/// Returns the force that is exerted with k_s, as that of a spring compressed by all that the law can have
/// compressed it.
double HapticCore::load_n(const Before& before, const LiveParameters& parameters) const HAPTICD_RT {
  const double exerted_n = before.gain * norm(before.law_force_n_in_world);
  if (!(exerted_n > 0) || hasProxy(laws_.law())) return exerted_n;
  return std::max(exerted_n, before.gain * before.stiffness_n_per_m * parameters.force.radius_m);
}

/// Evaluates the law at the handle's position, with the stiffness in effect and the friction of the tissue
/// where the proxy is.
ForceSample HapticCore::forceOfLaw(const Input& input, const Tick& tick) HAPTICD_RT {
  const LiveParameters& parameters = input.directive.parameters;
  const ContactParameters& contact = parameters.contact;
  const bool in_tissue = TissueContact::isActive(input.tissue);
  return laws_.force({.scene = input.scene,
                      .hip_m_in_world = input.handle.position_m_in_world,
                      .hip_velocity_m_per_s_in_world = input.handle.velocity_m_per_s_in_world,
                      .parameters = parameters,
                      .stiffness_n_per_m = tick.stiffness_n_per_m,
                      .friction = in_tissue ? state_.tissue.frictionOfLaw(contact) : contact.friction,
                      .frame_age_s = frameAge_s(input.scene, input.now_ns, input.start.camera_latency_s),
                      .period_s = input.period_s});
}

/// Replaces the law's force by that of the stiffness map where there is one.
LocalContact HapticCore::applyTissue(const Input& input, ForceSample& sample, Tick& tick) HAPTICD_RT {
  const LocalContact contact =
      state_.tissue.apply({.map = input.tissue,
                           .model = input.scene.depth_model,
                           .parameters = input.directive.parameters.contact,
                           .stiffness_n_per_m = tick.stiffness_n_per_m,
                           .hip_m_in_world = input.handle.position_m_in_world,
                           .velocity_m_per_s_in_world = input.handle.velocity_m_per_s_in_world,
                           .period_s = input.period_s},
                          sample);
  tick.tissue_region = contact.region;
  return contact;
}

/// Learns from the motion of the HIP since the last tick what the law's proxy does in the same scene.
JointStiffness HapticCore::followGrip(const Input& input, const ForceSample& sample) HAPTICD_RT {
  LawGrip& law = state_.law_grip;
  const std::uint64_t model = isHeld(sample.state) && hasProxy(laws_.law()) ? input.scene.model : 0;
  if (model != 0 && law.model == 0) law.grip.begin(sample.normal_in_world);
  if (model != 0 && law.model == model) {
    law.grip.follow(input.handle.position_m_in_world - state_.before.hip_m_in_world,
                    sample.proxy_m_in_world - law.proxy_m_in_world, kLearned_m);
  }
  law.proxy_m_in_world = sample.proxy_m_in_world;
  law.model = model;
  return model != 0 ? law.grip.across(sample.normal_in_world) : JointStiffness{};
}

/// Lets the force of another law than that of the last tick begin, while that one's leaves.
void HapticCore::enterLaw(const Input& input, const Tick& tick, Evaluation& evaluation) HAPTICD_RT {
  const Before& before = state_.before;
  const Vec3& force_n = evaluation.sample.force_n_in_world;
  if (state_.origin.model != 0 && state_.law != laws_.law() && before.gain > 0) {
    const double share = before.gain / before.mode_gain;
    // Springs without a proxy pull a hand through the surface that is behind it.
    const bool begins = dot(force_n, before.law_force_n_in_world) > 0;
    state_.law_grip = {};
    state_.law_entry = begins ? LawEntry::slowly() : LawEntry::outside();
    evaluation.left = {.force_n_in_world = share * before.law_force_n_in_world,
                       .stiffness_n_per_m = share * before.stiffness_n_per_m,
                       .hip_m_in_world = before.hip_m_in_world,
                       .retreat_m_per_s = begins ? kMaxGrowth_m_per_s : kMaxRetreat_m_per_s};
  }
  state_.law = laws_.law();
  evaluation.share = state_.law_entry.advance(norm(force_n), tick.stiffness_n_per_m, input.period_s);
}

/// Evaluates law and stiffness map, or briefly holds the last force where the scene is not modelled.
HapticCore::Evaluation HapticCore::evaluateLaw(const Input& input, Tick& tick) HAPTICD_RT {
  Evaluation evaluation{forceOfLaw(input, tick), {}};
  ForceSample& sample = evaluation.sample;
  evaluation.contact = applyTissue(input, sample, tick);
  tick.law = laws_.law();
  tick.contact = sample.state;
  tick.proxy_m_in_world = sample.proxy_m_in_world;
  tick.outside_model = sample.outside_model;
  if (sample.outside_model) {
    state_.outside_model_s += input.period_s;
    if (state_.outside_model_s > kMaxHold_s) {
      state_.held_force_n_in_world = {};
      state_.too_near = false;
    }
    sample.force_n_in_world = state_.held_force_n_in_world;
    return evaluation;
  }
  enterLaw(input, tick, evaluation);
  evaluation.grip = followGrip(input, sample);
  state_.outside_model_s = 0;
  state_.too_near = sample.too_near;
  tick.points_used = sample.points_used;
  evaluation.share *= tick.depth_share;
  if (evaluation.share < 1) sample.force_n_in_world = evaluation.share * sample.force_n_in_world;
  tick.law_force_n_in_world = sample.force_n_in_world;
  state_.held_force_n_in_world = isFinite(sample.force_n_in_world) ? sample.force_n_in_world : Vec3{};
  return evaluation;
}

/// Returns how much more the force of a law with a proxy changed than the HIP's displacement explains: the
/// surface moved, the proxy is still catching up, or it slipped off an edge.
double HapticCore::unexplained_n(const Input& input, const LocalContact& contact,
                                 double fixture_stiffness_n_per_m,
                                 const Vec3& force_n_in_world) const HAPTICD_RT {
  if (!hasProxy(laws_.law()) && !(fixture_stiffness_n_per_m > 0)) return 0;
  const double displacement_m = norm(input.handle.position_m_in_world - state_.before.hip_m_in_world);
  const double speed_change =
      norm(input.handle.velocity_m_per_s_in_world - state_.before.velocity_m_per_s_in_world);
  const double stiffness = contact.steepest_n_per_m + fixture_stiffness_n_per_m;
  const double explained_n = stiffness * displacement_m + contact.damping_n_s_per_m * speed_change;
  return std::max(0.0, norm(force_n_in_world - state_.before.force_n_in_world) - explained_n);
}

/// Computes the forces of the virtual fixtures, as they are exerted.
FixtureForces::Output HapticCore::evaluateFixtures(const Input& input, const Evaluation& evaluation,
                                                   const LagRules& rules, Tick& tick) HAPTICD_RT {
  FixtureForces::Output output;
  output.proxy_m_in_world = input.handle.position_m_in_world;
  if (input.fixtures != nullptr) {
    const LiveParameters& parameters = input.directive.parameters;
    const double scale = input.start.handle.motion_scale * input.start.handle.force_scale;
    const double of_law = tick.stiffness_gain * rules.damping_n_s_per_m;
    const bool engaged = state_.supervisor.mode() == Mode::engaged;
    output = state_.fixtures.step(
        {.set = *input.fixtures,
         .scene = input.scene,
         .hip_m_in_world = input.handle.position_m_in_world,
         .velocity_m_per_s_in_world = input.handle.velocity_m_per_s_in_world,
         .parameters = parameters,
         .stiffness_n_per_m = tick.stiffness_n_per_m,
         .law = evaluation.sample,
         .surface_law = rowOf(laws_.law()).carries_standoffs,
         .frame_age_s = frameAge_s(input.scene, input.now_ns, input.start.camera_latency_s),
         .depth_share = tick.depth_share,
         .frames = state_.frames.places(),
         .now_ns = input.now_ns,
         .period_s = input.period_s,
         .engages = engaged && !state_.exerting,
         .begins_anew = state_.supervisor.returns(),
         .exerted_share = state_.before.mode_gain,
         .lag_damping_s = rules.fixture_damping_s,
         .max_stiffness_n_per_m = rules.fixture_stiffness_n_per_m,
         .max_damping_n_s_per_m = std::max(0.0, rules.largest_damping_n_s_per_m / scale - of_law),
         .law_stiffness_n_per_m = evaluation.contact.largest_n_per_m,
         .left_law = evaluation.left,
         .law_grip = evaluation.grip});
    state_.exerting = engaged;
  }
  state_.law_share = output.law_share;
  tick.fixtures_in_contact = output.in_contact;
  tick.nearest_fixture = output.nearest;
  tick.fixture_distance_m = output.distance_m;
  tick.fixture_proxy_m_in_world = output.proxy_m_in_world;
  tick.fixture_force_n_in_world = output.force_n + output.slowing_force_n;
  tick.guidance_force_n_in_world = output.guidance_force_n;
  return output;
}

/// Blends the force of law and forbidden regions over a change of scene, law, parameters or fixtures. The
/// force is clamped to the limit first, so that the blend never starts from more than the handle can have
/// exerted. All this happens before the law's stiffness limit, which is already in the forces of fixtures.
HapticCore::Change HapticCore::blend(const Input& input, const Evaluation& evaluation,
                                     const FixtureForces::Output& fixtures, Tick& tick) HAPTICD_RT {
  const LiveParameters& parameters = input.directive.parameters;
  const ForceSample& sample = evaluation.sample;
  const LocalContact& contact = evaluation.contact;
  const double to_law = 1 / tick.stiffness_gain;
  const double limit = parameters.safety.max_force_n / (input.start.handle.force_scale * tick.stiffness_gain);
  const double of_law_n = norm(sample.force_n_in_world);
  const Vec3 law_n = shortened(sample.force_n_in_world, of_law_n, limit);
  const Vec3 force_n_in_world = fixtures.holds ? law_n + to_law * fixtures.spring_force_n : law_n;
  const double fixture_stiffness = to_law * fixtures.steepest_n_per_m;
  const double stiffness = std::max(tick.stiffness_n_per_m, contact.tangent_n_per_m) + fixture_stiffness;
  const double length = norm(force_n_in_world);
  const Vec3 cut =
      std::isfinite(length) && length > limit ? (limit / length) * force_n_in_world : force_n_in_world;
  SpringParameters springs = parameters.force;
  if (state_.stiffness.on()) springs.stiffness_n_per_m = 0;
  const Origin now{.model = input.scene.model,
                   .law = laws_.law(),
                   .springs = springs,
                   .contact = parameters.contact,
                   .held = tick.outside_model,
                   .fixtures = tick.fixture_generation,
                   .tissue_generation = TissueContact::generationOf(input.tissue)};
  const double max_n = stiffness * kFastestSurface_m_per_s * input.period_s;
  const double unexplained = unexplained_n(input, contact, fixture_stiffness, cut);
  const bool comparable = state_.origin.model != 0;
  Change change;
  change.inputs = comparable && now != state_.origin;
  // Where the springs are saturated, a surface that moves changes their energy without changing the force.
  change.surface = change.inputs || unexplained > 0 || (hasProxy(laws_.law()) && of_law_n > limit);
  const bool blends = change.inputs || (comparable && unexplained > max_n);
  state_.origin = now;
  // The law's springs saturate as those of fixtures do.
  const double k = evaluation.share * tick.stiffness_n_per_m;
  const double cut_j =
      k > 0 ? of_law_n * of_law_n / (2 * k) - SaturatingSpring{k, limit}.energy_j(of_law_n / k) : 0;
  const double uncut_j = contact.in_tissue ? evaluation.share * contact.energy_j
                         : k > 0           ? of_law_n * of_law_n / (2 * k)
                                           : 0;
  state_.before = {.hip_m_in_world = input.handle.position_m_in_world,
                   .velocity_m_per_s_in_world = input.handle.velocity_m_per_s_in_world,
                   .force_n_in_world = cut,
                   .gain = state_.before.gain,
                   .mode_gain = state_.before.mode_gain,
                   .law_force_n_in_world = law_n,
                   .fixture_j = fixtures.stored_j,
                   .guidance_j = fixtures.guidance_j,
                   .fixture_changes_j = fixtures.changes_j,
                   .standoff_force_n_in_world = fixtures.standoff_force_n,
                   .standoff_j = fixtures.standoff_j,
                   .standoff_power_w = fixtures.standoff_power_w,
                   .law_j = std::max(0.0, uncut_j - cut_j),
                   .stiffness_n_per_m = k,
                   .handle_ns = input.handle.time_ns};
  const Vec3 blended =
      state_.blend.apply(cut, blends, parameters.blend, stiffness, input.period_s, blends ? 0 : unexplained);
  tick.blending = !(blended == cut);
  tick.blended_force_n_in_world = blended;
  return change;
}

/// Computes what keeps the loop stable at its current lag: the share of the law's force to exert and the
/// contact damping. Damping applied by the device itself is not delayed, so the limit by the device's mass
/// does not apply to it.
HapticCore::LagRules HapticCore::lagRules(const Input& input, const Evaluation& evaluation,
                                          Tick& tick) HAPTICD_RT {
  const LocalContact& contact = evaluation.contact;
  const bool in_contact = isHeld(evaluation.sample.state) || evaluation.sample.points_used > 0;
  const LiveParameters& parameters = input.directive.parameters;
  const double scale = input.start.handle.motion_scale * input.start.handle.force_scale;
  const double stiffness = contact.largest_n_per_m;
  const double damping_of_law = hasProxy(parameters.law) ? contact.damping_n_s_per_m : 0;
  const bool automatic = parameters.safety.contact_damping == ContactDamping::automatic;
  LagRules rules;
  const double held_s = input.loop_period_s > 0 ? input.loop_period_s : input.period_s;
  rules.lag_s = loopLag_s(held_s, state_.latency.delay_s(input.handle), parameters.safety.force_filter_hz);
  const double mass_kg = state_.latency.deviceMass_kg(input.start.device_mass_kg);
  rules.largest_damping_n_s_per_m = largestDamping_n_s_per_m(mass_kg, rules.lag_s);

  const bool by_mass = automatic && !input.handle.damps;
  const double limit_at_hand =
      by_mass ? stiffnessOfMass_n_per_m(mass_kg, rules.lag_s)
              : largestStableStiffness_n_per_m(input.start.handle.damping_n_s_per_m,
                                               scale * parameters.contact.damping_n_s_per_m, rules.lag_s);
  tick.stiffness_limit_n_per_m = limit_at_hand / scale;
  const bool limited = stiffness > tick.stiffness_limit_n_per_m;
  if (limited) tick.stiffness_rule = by_mass ? StiffnessRule::mass : StiffnessRule::delay;
  const bool reduces = parameters.safety.stiffness_limit == StiffnessLimit::reduce;
  const double alone = limited && reduces ? tick.stiffness_limit_n_per_m / stiffness : 1;
  state_.stiffness_share.aimAt(alone * state_.law_share);
  if (in_contact) {
    state_.stiffness_share.advance(input.period_s);
  } else {
    state_.stiffness_share.advanceFree(input.period_s);
  }
  tick.stiffness_gain = state_.stiffness_share.value();
  rules.fixture_stiffness_n_per_m =
      reduces ? tick.stiffness_limit_n_per_m : std::numeric_limits<double>::infinity();
  if (!automatic) return rules;

  rules.fixture_damping_s = input.handle.damps ? 0 : contactDamping_n_s_per_m(1, rules.lag_s);
  const double most = by_mass ? rules.largest_damping_n_s_per_m / (scale * tick.stiffness_gain)
                              : std::numeric_limits<double>::infinity();
  const double damping = std::min(most, contactDamping_n_s_per_m(contact.tangent_n_per_m, rules.lag_s));
  if (std::isfinite(damping)) rules.damping_n_s_per_m = std::max(0.0, damping - damping_of_law);
  rules.across_n_s_per_m = std::min(most, contactDamping_n_s_per_m(contact.secant_n_per_m, rules.lag_s));
  return rules;
}

/// Adds the contact damping, unless the device applies it, and the forces of fixtures that guide or slow the
/// HIP.
Vec3 HapticCore::damp(const Input& input, const Evaluation& evaluation, const FixtureForces::Output& fixtures,
                      const LagRules& rules, Tick& tick) const HAPTICD_RT {
  const ForceSample& sample = evaluation.sample;
  const Vec3 velocity =
      velocityToDamp(input.handle.velocity_m_per_s_in_world, sample.surface_velocity_m_per_s_in_world);
  const double here = input.handle.damps ? 0 : 1;
  const double to_law = 1 / tick.stiffness_gain;
  const Vec3 force = fixtures.holds ? tick.blended_force_n_in_world - to_law * fixtures.spring_force_n
                                    : tick.blended_force_n_in_world;
  tick.damped_force_n_in_world =
      damped({force, sample.normal_in_world, velocity, here * rules.across_n_s_per_m, evaluation.grip},
             here * rules.damping_n_s_per_m);
  if (fixtures.holds) tick.damped_force_n_in_world += to_law * fixtures.force_n;
  if (!(fixtures.guidance_force_n == Vec3{}))
    tick.damped_force_n_in_world += to_law * fixtures.guidance_force_n;
  if (!(fixtures.slowing_force_n == Vec3{}))
    tick.damped_force_n_in_world += to_law * fixtures.slowing_force_n;
  return tick.damped_force_n_in_world;
}

/// Returns the force that measures the latency of the device.
Vec3 HapticCore::knock(const Input& input) HAPTICD_RT {
  return state_.latency.step({.handle = input.handle,
                              .engaged = state_.supervisor.mode() == Mode::engaged,
                              .motion_scale = input.start.handle.motion_scale,
                              .command_n_in_world = state_.safety.lastForce_n_in_world(),
                              .period_s = input.period_s});
}

/// Returns the palpation cue of this tick.
Vec3 HapticCore::cue(const Input& input, const Evaluation& evaluation, const Tick& tick) HAPTICD_RT {
  const bool engaged = state_.supervisor.mode() == Mode::engaged;
  return state_.cue.apply({.allowed = engaged && evaluation.contact.in_tissue,
                           .amplitude_n = evaluation.contact.cue_force_n,
                           .frequency_hz = evaluation.contact.cue_hz,
                           .contact_force_n = norm(tick.scaled_force_n_in_world),
                           .normal_in_world = evaluation.sample.normal_in_world,
                           .velocity_m_per_s_in_world = input.handle.velocity_m_per_s_in_world,
                           .period_s = input.period_s},
                          input.directive.parameters.safety);
}

/// Computes the command from the law's force.
SafetyChain::Output HapticCore::computeCommand(const Input& input, const Supervisor::Obstacle& obstacle,
                                               Tick& tick) HAPTICD_RT {
  const LiveParameters& parameters = input.directive.parameters;
  const Before before = state_.before;
  const bool comparable = state_.origin.model != 0;
  tick.depth_share = state_.supervisor.depthShare();
  // What exerts nothing begins at the hand when it does again.
  if (state_.supervisor.returns() || !(tick.depth_share > 0)) {
    laws_.release();
    state_.tissue.release();
    if (state_.supervisor.mode() != Mode::idle) state_.law_entry = LawEntry::outside();
  } else if (state_.supervisor.mode() == Mode::idle) {
    state_.law_entry = {};
  }
  const Evaluation evaluation = evaluateLaw(input, tick);
  const LagRules rules = lagRules(input, evaluation, tick);
  const FixtureForces::Output fixtures = evaluateFixtures(input, evaluation, rules, tick);
  const Change change = blend(input, evaluation, fixtures, tick);
  const Vec3 damped_n = damp(input, evaluation, fixtures, rules, tick);
  state_.supervisor.decide(input, obstacle,
                           {.in_contact = norm(tick.law_force_n_in_world) > 0 || fixtures.holds,
                            .too_near = state_.too_near,
                            .in_debt = isInDebt(input, tick),
                            .keeps = keepsWithoutDepth(input.fixtures)});
  const double mode_gain = state_.supervisor.gain();
  const double gain = mode_gain * tick.stiffness_gain;
  state_.before.gain = gain;
  state_.before.mode_gain = mode_gain;
  tick.gain = gain;
  const HandleScaleParameters& scale = input.start.handle;
  tick.contact_damping_n_s_per_m = gain * scale.motion_scale * scale.force_scale * rules.damping_n_s_per_m;
  if (fixtures.holds) {
    tick.contact_damping_n_s_per_m +=
        mode_gain * scale.motion_scale * scale.force_scale * fixtures.damping_n_s_per_m;
  }
  tick.scaled_force_n_in_world = gain * scale.force_scale * damped_n;
  state_.stiffness.follow(
      StiffnessRules::of(parameters, scale, tick.stiffness_limit_n_per_m, input.scene.noise),
      inContact(tick) || fixtures.holds, input.period_s);
  SafetyChain::Motion motion;
  if (comparable) motion = motionSince(before, change, input, evaluation, tick);
  const double slowing_n_s_per_m =
      mode_gain * scale.motion_scale * scale.force_scale * fixtures.slowing_n_s_per_m;
  motion.max_damping_n_s_per_m = rules.largest_damping_n_s_per_m - slowing_n_s_per_m -
                                 (input.handle.damps ? 0 : tick.contact_damping_n_s_per_m);
  motion.cue_n_in_world = tick.cue_force_n_in_world = cue(input, evaluation, tick) + knock(input);
  motion.external_n_in_world = mode_gain * input.external_n_in_world;
  tick.hidden_latency_s = state_.latency.hidden_s();
  return state_.safety.apply(tick.scaled_force_n_in_world, parameters.safety, input.period_s, motion);
}

Tick HapticCore::step(const Input& input) HAPTICD_RT {
  Tick tick;
  tick.hip_m_in_world = input.handle.position_m_in_world;
  tick.proxy_m_in_world = tick.hip_m_in_world;
  tick.fixture_proxy_m_in_world = tick.hip_m_in_world;
  tick.stiffness_n_per_m = state_.stiffness.begin(
      input.directive.parameters, load_n(state_.before, input.directive.parameters), input.period_s);
  tick.handle = input.handle;
  tick.external_force_n_in_world = input.external_n_in_world;
  tick.directive_generation = input.directive.generation;
  tick.after_overrun = input.overran;
  tick.tissue_generation = input.tissue == nullptr ? 0 : input.tissue->generation;
  tick.fixture_generation = input.fixtures == nullptr ? 0 : input.fixtures->generation;
  tick.scene_frame = input.scene.frame;
  tick.scene_model = input.scene.model;
  tick.scene_age_ns = input.scene.frame == 0 ? 0 : input.now_ns - input.scene.frame_time_ns;

  if (state_.last_ns != 0 && input.now_ns - state_.last_ns > kCommandLife_ns) {
    state_.safety.restart();
    state_.supervisor.restartRamp();
  }
  state_.last_ns = input.now_ns;
  // The law is evaluated in every mode with valid inputs, so that status shows contact before engaging.
  const SafetyParameters& safety = input.directive.parameters.safety;
  state_.frames.step(framesOf(input.fixtures), tick.fixture_generation, input.poses, input.now_ns,
                     input.period_s);
  tick.frame_pose = state_.frames.newestPose();
  Supervisor::Obstacle obstacle = state_.supervisor.look(input);
  const bool only_depth = obstacle.cause == Cause::none || obstacle.cause == Cause::depth_stale;
  if (only_depth && stopsForFrame(input.fixtures, state_.frames.places())) obstacle.cause = Cause::frame_lost;
  SafetyChain::Output out;
  if (obstacle.law_usable) {
    out = computeCommand(input, obstacle, tick);
  } else {
    release();  // the positions of the proxies have become meaningless
    state_.tissue.release();
    state_.cue = {};
    state_.blend.reset();
    state_.origin = {};
    state_.too_near = false;
    state_.supervisor.decide(input, obstacle, {});
    tick.released = obstacle.releases;
    out = obstacle.releases ? state_.safety.release(safety, input.period_s)
                            : state_.safety.apply({}, safety, input.period_s);
  }
  if (out.not_finite) {
    state_.supervisor.fault();
    state_.held_force_n_in_world = {};
  }
  tick.mode = state_.supervisor.mode();
  tick.cause = state_.supervisor.cause();
  tick.stiffness_bound = state_.stiffness.bound();
  tick.surface_noise_m = input.scene.frame == 0 ? 0 : input.scene.noise.noise_m;
  tick.slew_limited = out.slew_limited;
  tick.magnitude_clamped = out.magnitude_clamped;
  tick.not_finite = out.not_finite;
  tick.passivity_acted = out.passivity_acted;
  tick.thermally_limited = out.thermally_limited;
  tick.energy_j = state_.safety.energy_j();
  tick.passive_force_n_in_world = out.passive_n_in_world;
  tick.filtered_force_n_in_world = out.filtered_n_in_world;
  tick.slewed_force_n_in_world = out.slewed_n_in_world;
  tick.command_force_n_in_world = out.force_n_in_world;
  return tick;
}

}  // namespace hapticd::rt
