// SPDX-License-Identifier: Apache-2.0
#include "rt/tissue/tissue_contact.h"

#include <algorithm>
#include <cmath>

#include "rt/safety/contact_damping.h"

namespace hapticd::rt {
namespace {

/// The secant stiffness is taken at this depth or below, where a Hunt-Crossley contact has one.
constexpr double kMinDepth_m = 0.001;

/// The contact with all tissue at the proxy, weighted by the shares.
struct MixedContact {
  ModelContact mean;
  double secant_n_per_m = 0;
  double friction = 0;
  double damping_slope_n_s_per_m2 = 0;  ///< derivative of the damping by the depth
  Vec3 energy_gradient_n_in_world;      ///< sum of u_i grad w_i
  Vec3 force_gradient_n_per_m;          ///< sum of f_i grad w_i
  Vec3 damping_gradient;                ///< sum of b_i grad w_i
  double bend_n_per_m = 0;              ///< bound of the sum of u_i times the second derivative of w_i

  void add(const TissueShares::Entry& at, const ModelContact& contact, double secant, double of_friction,
           double damping_per_force_s_per_m) noexcept {
    mean.force_n += at.share * contact.force_n;
    mean.energy_j += at.share * contact.energy_j;
    mean.tangent_n_per_m += at.share * contact.tangent_n_per_m;
    mean.damping_n_s_per_m += at.share * contact.damping_n_s_per_m;
    secant_n_per_m += at.share * secant;
    friction += at.share * of_friction;
    damping_slope_n_s_per_m2 += at.share * damping_per_force_s_per_m * contact.tangent_n_per_m;
    energy_gradient_n_in_world += contact.energy_j * at.gradient_per_m_in_world;
    force_gradient_n_per_m += contact.force_n * at.gradient_per_m_in_world;
    damping_gradient += contact.damping_n_s_per_m * at.gradient_per_m_in_world;
    bend_n_per_m += contact.energy_j * at.bend_per_m2;
  }

  /// Returns the force without friction: along the normal, and what leads towards less stored energy as far
  /// as friction does not hold it.
  Vec3 force_n(const Vec3& normal, const Vec3& velocity_m_per_s) const noexcept {
    const double pressed_n =
        std::max(0.0, mean.force_n - mean.damping_n_s_per_m * dot(velocity_m_per_s, normal));
    const Vec3& gradient = energy_gradient_n_in_world;
    const Vec3 slope_n = dot(gradient, normal) * normal - gradient;
    const double length_n = norm(slope_n);
    const double held_n = friction * mean.force_n;
    const double exerted = length_n > held_n ? 1 - held_n / length_n : 0;
    return pressed_n * normal + exerted * slope_n;
  }

  /// Returns a bound of the force's change per displacement. `aside_n_per_m`: of the springs along the
  /// surface.
  double steepest_n_per_m(double aside_n_per_m, double speed_m_per_s) const noexcept {
    return std::max(mean.tangent_n_per_m, aside_n_per_m) + bend_n_per_m + norm(force_gradient_n_per_m) +
           speed_m_per_s * (damping_slope_n_s_per_m2 + norm(damping_gradient));
  }
};

/// Returns the region with the stiffness in effect.
TissueRegion inEffect(const TissueRegion& region, const TissueContact::Following& following) noexcept {
  TissueRegion effective = region;
  effective.stiffness_n_per_m = following.stiffness_n_per_m;
  effective.lower_stiffness_n_per_m = following.lower_stiffness_n_per_m;
  return effective;
}

MixedContact mixedAt(const TissueMap& map, const TissueContact::Memory& memory,
                     const LiveParameters& parameters, const TissueShares& shares, double depth_m) noexcept {
  MixedContact mixed;
  const double stiffness = parameters.force.stiffness_n_per_m;
  if (shares.rest.share > 0) {
    mixed.add(shares.rest, linearContact(stiffness, parameters.contact.damping_n_s_per_m, depth_m), stiffness,
              parameters.contact.friction, 0);
  }
  const double secant_depth_m = std::max(depth_m, kMinDepth_m);
  for (std::size_t i = 0; i < shares.count; ++i) {
    const TissueShares::Entry& at = shares.entries[i];
    const TissueRegion region = inEffect(map.regions[at.region], memory.following[at.region]);
    const ModelContact contact = contactOf(region, depth_m);
    const double secant = depth_m >= kMinDepth_m ? contact.force_n / depth_m
                                                 : contactOf(region, secant_depth_m).force_n / secant_depth_m;
    const bool by_force = region.model == ContactModel::hunt_crossley;
    mixed.add(at, contact, secant, region.friction, by_force ? region.damping_per_speed_s_per_m : 0);
  }
  return mixed;
}

/// Returns the largest tangent stiffness of the map's regions at kDeep_m, with `following` in effect.
double largestTangent_n_per_m(const TissueMap& map, const TissueContact::Memory& memory) noexcept {
  double largest = 0;
  for (std::size_t i = 0; i < map.count; ++i) {
    const TissueRegion region = inEffect(map.regions[i], memory.following[i]);
    double tangent = contactOf(region, TissueContact::kDeep_m).tangent_n_per_m;
    if (region.model == ContactModel::layered) {
      tangent = std::max(region.stiffness_n_per_m, region.lower_stiffness_n_per_m);
    }
    largest = std::max(largest, tangent);
  }
  return largest;
}

/// Adds the largest share and the palpation cue.
void describe(const TissueMap& map, const TissueShares& shares, LocalContact& contact) noexcept {
  double largest_share = shares.rest.share;
  double largest_cue_n = 0;
  for (std::size_t i = 0; i < shares.count; ++i) {
    const TissueShares::Entry& at = shares.entries[i];
    const TissueRegion& region = map.regions[at.region];
    if (at.share > largest_share) {
      largest_share = at.share;
      contact.region = static_cast<std::int32_t>(at.region);
    }
    const double cue_n = at.share * region.cue_force_n;
    contact.cue_force_n += cue_n;
    if (cue_n > largest_cue_n) {
      largest_cue_n = cue_n;
      contact.cue_hz = region.cue_hz;
    }
  }
}

/// Returns how a stiffness follows the map's in contact.
double followed(double current, double aim, double step) noexcept {
  return aim < current ? std::max(aim, current - step) : current;
}

/// Returns the contact of the law alone, a spring of k_s.
LocalContact withoutTissue(const LiveParameters& parameters) noexcept {
  const double stiffness = parameters.force.stiffness_n_per_m;
  LocalContact contact;
  contact.tangent_n_per_m = contact.secant_n_per_m = stiffness;
  contact.steepest_n_per_m = contact.largest_n_per_m = stiffness;
  contact.damping_n_s_per_m = parameters.contact.damping_n_s_per_m;
  contact.friction = parameters.contact.friction;
  return contact;
}

}  // namespace

/// Arranges the stiffnesses in effect in the order of a changed map.
void TissueContact::takeOver(const TissueMap& map, bool in_contact) HAPTICD_RT {
  const std::array<Following, kMaxTissueRegions> before = memory_.following;
  const std::size_t before_count = memory_.count;
  for (std::size_t i = 0; i < map.count; ++i) {
    const TissueRegion& region = map.regions[i];
    Following& following = memory_.following[i];
    following = {region.identity, region.stiffness_n_per_m, region.lower_stiffness_n_per_m};
    if (!in_contact) continue;
    std::size_t old = i;  // mostly at the same place
    if (old >= before_count || before[old].identity != region.identity) {
      for (old = 0; old < before_count && before[old].identity != region.identity; ++old) {
      }
    }
    if (old < before_count) {
      following = before[old];
      continue;
    }
    following.stiffness_n_per_m = std::min(following.stiffness_n_per_m, memory_.contact.secant_n_per_m);
    following.lower_stiffness_n_per_m =
        std::min(following.lower_stiffness_n_per_m, memory_.contact.secant_n_per_m);
  }
  memory_.count = map.count;
  memory_.generation = map.generation;
}

/// Lets the stiffnesses in effect follow those of the map.
void TissueContact::follow(const TissueMap& map, bool in_contact, double period_s) HAPTICD_RT {
  const bool changed = !memory_.active || memory_.generation != map.generation || memory_.count != map.count;
  if (changed) takeOver(map, in_contact);
  bool moved = changed;
  const double step = kFall_n_per_m_per_s * period_s;
  for (std::size_t i = 0; i < map.count; ++i) {
    const TissueRegion& region = map.regions[i];
    Following& following = memory_.following[i];
    if (following.stiffness_n_per_m == region.stiffness_n_per_m &&
        following.lower_stiffness_n_per_m == region.lower_stiffness_n_per_m) {
      continue;
    }
    moved = true;
    following.stiffness_n_per_m = in_contact
                                      ? followed(following.stiffness_n_per_m, region.stiffness_n_per_m, step)
                                      : region.stiffness_n_per_m;
    following.lower_stiffness_n_per_m =
        in_contact ? followed(following.lower_stiffness_n_per_m, region.lower_stiffness_n_per_m, step)
                   : region.lower_stiffness_n_per_m;
  }
  if (moved) memory_.largest_n_per_m = largestTangent_n_per_m(map, memory_);
}

LocalContact TissueContact::apply(const Input& input, ForceSample& sample) HAPTICD_RT {
  const LiveParameters& parameters = input.parameters;
  if (!isActive(input.map)) {
    memory_ = {};
    return withoutTissue(parameters);
  }
  if (sample.outside_model && memory_.active) {
    follow(*input.map, memory_.in_contact, input.period_s);
    return memory_.contact;
  }
  const double stiffness = parameters.force.stiffness_n_per_m;
  const bool in_contact =
      isHeld(sample.state) && sample.depth_m > 0 && !(sample.normal_in_world == Vec3{}) && stiffness > 0;
  // What was not in contact yet exerts no force that could step.
  follow(*input.map, in_contact && memory_.in_contact, input.period_s);

  const TissueShares shares = sharesAt(*input.map, input.model, sample.proxy_m_in_world);
  const MixedContact mixed =
      mixedAt(*input.map, memory_, parameters, shares, in_contact ? sample.depth_m : 0);
  const Vec3 velocity =
      velocityToDamp(input.velocity_m_per_s_in_world, sample.surface_velocity_m_per_s_in_world);
  LocalContact contact = withoutTissue(parameters);
  contact.largest_n_per_m = std::max(stiffness, memory_.largest_n_per_m);
  contact.tangent_n_per_m = mixed.mean.tangent_n_per_m;
  contact.secant_n_per_m = mixed.secant_n_per_m;
  contact.damping_n_s_per_m = mixed.mean.damping_n_s_per_m;
  contact.friction = mixed.friction;
  const double steepest = mixed.steepest_n_per_m(stiffness, norm(velocity));
  contact.steepest_n_per_m = memory_.in_contact ? std::max(steepest, memory_.steepest_n_per_m) : steepest;
  memory_.active = true;
  memory_.in_contact = in_contact;
  memory_.friction = stiffness > 0 ? mixed.friction * mixed.secant_n_per_m / stiffness : 0;
  memory_.steepest_n_per_m = steepest;
  if (in_contact) {
    const Vec3 to_proxy = sample.proxy_m_in_world - input.hip_m_in_world;
    const Vec3 aside_m = to_proxy - dot(to_proxy, sample.normal_in_world) * sample.normal_in_world;
    sample.force_n_in_world = mixed.force_n(sample.normal_in_world, velocity) + stiffness * aside_m;
    contact.in_tissue = true;
    contact.energy_j = mixed.mean.energy_j + stiffness * dot(aside_m, aside_m) / 2;
    describe(*input.map, shares, contact);
  }
  return memory_.contact = contact;
}

}  // namespace hapticd::rt
