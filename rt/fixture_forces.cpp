// SPDX-License-Identifier: Apache-2.0
#include "rt/fixture_forces.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "rt/contact_damping.h"
#include "rt/joint_stiffness.h"

namespace hapticd::rt {
namespace {

/// Damping rises to its full value over this depth, and falls to nothing over this depth beyond the
/// saturation of the spring, which has no stiffness there that the lag could make unstable.
constexpr double kDampingRamp_m = 0.001;
/// Damping against the lag reaches this multiple of the spring's force at any depth. It is due from the first
/// tick of a contact on, because a sampled spring gives energy from there on, and the factor keeps the force
/// from stepping.
constexpr double kDampingOfSpring = 10;
/// What can act within this distance of the HIP counts for the stiffness limit, so that it has taken effect
/// when it does.
constexpr double kNear_m = 0.005;
/// A region that moves farther over the HIP at once is treated as a new one.
constexpr double kMaxCarry_m = 0.05;
/// A contact with the law is expected to come again within this distance of the last one.
constexpr double kSamePlace_m = 0.05;
/// Guidance is weaker than contact by this factor.
constexpr double kGuidanceShare = 1.0 / 3;
/// Change per tick of the force of guidance that has ended.
constexpr double kMaxFade_n = 0.04;

const FixtureMemory* find(const std::array<FixtureMemory, kMaxFixtures>& memories,
                          std::uint32_t identity) noexcept {
  const auto found = std::ranges::find_if(memories, [identity](const FixtureMemory& memory) {
    return memory.definition != 0 && memory.identity == identity;
  });
  return found == memories.end() ? nullptr : &*found;
}

}  // namespace

/// One tick of all fixtures.
class FixtureForces::Tick {
 public:
  Tick(const Input& input, Memory& memory) noexcept
      : input_(input),
        memory_(memory),
        hip_(input.hip_m_in_world),
        motion_(memory.placed ? hip_ - memory.hip_m_in_world : Vec3{}),
        surface_(input.scene, input.surface_law, input.parameters.surface.shell_m, input.frame_age_s,
                 largestClearance_m(input.set)) {}

  Output output() noexcept {
    out_.proxy_m_in_world = hip_;
    takeOver();
    followRegions();
    pushFromRegions();
    computeDistances();
    guideHip();
    limitStiffness();
    memory_.generation = input_.set.generation;
    memory_.placed = true;
    memory_.hip_m_in_world = hip_;
    memory_.depth_share = input_.depth_share;
    return out_;
  }

 private:
  static double largestClearance_m(const FixtureSet& set) noexcept {
    double largest_m = 0;
    for (std::size_t i = 0; i < set.count; ++i) {
      const Fixture& fixture = set.fixtures[i];
      if (fixture.kind == FixtureKind::standoff && fixture.enabled)
        largest_m = std::max(largest_m, fixture.clearance_m);
    }
    return largest_m;
  }

  std::size_t count() const noexcept { return input_.set.count; }
  const Fixture& fixture(std::size_t i) const noexcept { return input_.set.fixtures[i]; }
  FixtureMemory& memoryOf(std::size_t i) const noexcept { return memory_.fixtures[i]; }
  bool acts(std::size_t i) const noexcept { return memoryOf(i).definition != 0; }
  bool isRegion(std::size_t i) const noexcept { return acts(i) && !isGuidance(fixture(i).kind); }
  bool isStandoff(std::size_t i) const noexcept { return fixture(i).kind == FixtureKind::standoff; }
  /// Share of a fixture's force that is exerted.
  double shareOf(std::size_t i) const noexcept {
    return fixture(i).fades_without_depth ? input_.depth_share : 1;
  }

  /// Adapts the memory to a changed set, in which a fixture may have another place.
  void takeOver() noexcept {
    out_.redefined = memory_.placed && memory_.generation != input_.set.generation;
    if (memory_.placed && !out_.redefined) return;
    const auto before = memory_.fixtures;
    memory_.fixtures = {};
    for (std::size_t i = 0; i < count(); ++i) {
      if (!fixture(i).enabled) continue;
      const FixtureMemory* const known = find(before, fixture(i).identity);
      const bool same = known != nullptr && known->definition == fixture(i).definition;
      const bool carried = known != nullptr && !same && canCarry(fixture(i), *known);
      if (known != nullptr) spring_depth_m_[i] = known->region.springDepth_m();
      if (same || carried) memoryOf(i) = *known;
      memoryOf(i).definition = fixture(i).definition;
      memoryOf(i).identity = fixture(i).identity;
      if (carried) carry(i);
      if (!same && !carried) begin(i);
    }
    for (const FixtureMemory& old : before) {
      const FixtureMemory* const kept = old.definition == 0 ? nullptr : find(memory_.fixtures, old.identity);
      const bool same = kept != nullptr && kept->definition == old.definition;
      if (!same) memory_.left_guidance_n += old.guidance.force_n;
    }
  }

  /// Whether a changed region goes on from what is known of it.
  bool canCarry(const Fixture& changed, const FixtureMemory& known) const noexcept {
    if (isGuidance(changed.kind)) return false;
    if (changed.kind == FixtureKind::standoff) return true;
    const bool inside = keepsInside(changed, known.region.keeps_inside);
    return known.region.shape.kind == changed.shape.kind && known.region.keeps_inside == inside &&
           norm(carriedAlong(hip_, known.region.shape, changed.shape) - hip_) <= kMaxCarry_m;
  }
  static bool keepsInside(const Fixture& fixture, bool if_both) noexcept {
    return fixture.side == FixtureSide::in || (fixture.side == FixtureSide::both && if_both);
  }

  /// Starts a fixture anew. A region that the HIP is in begins at the HIP's depth.
  void begin(std::size_t i) noexcept {
    const Fixture& f = fixture(i);
    if (isGuidance(f.kind)) return;
    RegionMemory& region = memoryOf(i).region;
    region.shape = f.shape;
    region.stiffness_n_per_m = f.stiffness_n_per_m;
    region.max_force_n = f.max_force_n;
    renewed_[i] = true;
    from_[i] = hip_;
    if (isStandoff(i)) return;
    region.keeps_inside = keepsInside(f, distanceFrom(f.shape, hip_).distance_m < 0);
  }

  /// Moves the proxy, or where the HIP was, along with a region that has changed, so that it stays on its
  /// side of the region.
  void carry(std::size_t i) noexcept {
    RegionMemory& region = memoryOf(i).region;
    renewed_[i] = true;
    from_[i] = region.held ? region.proxy_m_in_world : memory_.hip_m_in_world;
    memoryOf(i).standoff = {};
    if (isStandoff(i)) return;
    from_[i] = carriedAlong(from_[i], region.shape, fixture(i).shape);
    region.shape = fixture(i).shape;
  }

  /// Lets a region that had ended without depth begin at the HIP's depth.
  void returns(std::size_t i) noexcept {
    renewed_[i] = true;
    from_[i] = hip_;
    spring_depth_m_[i] = 0;
  }

  void followRegions() noexcept {
    const double moved_m = norm(motion_);
    for (std::size_t i = 0; i < count(); ++i) {
      if (!isRegion(i)) continue;
      RegionMemory& region = memoryOf(i).region;
      region.room_m -= moved_m;
      if (memory_.depth_share == 0 && shareOf(i) > 0 && fixture(i).fades_without_depth) returns(i);
      if (!renewed_[i] && !region.held && region.room_m > kNear_m && !isStandoff(i)) continue;
      const Vec3 from = renewed_[i]   ? from_[i]
                        : region.held ? region.proxy_m_in_world
                                      : memory_.hip_m_in_world;
      RegionPlace place;
      if (isStandoff(i)) {
        const StandoffPlace standoff = followStandoff(surface_, fixture(i).clearance_m, region, hip_, motion_,
                                                      from, memoryOf(i).standoff);
        place = standoff.region;
        speed_m_per_s_[i] = standoff.speed_m_per_s;
      } else {
        place = followShape(region.shape, region.keeps_inside, fixture(i).clearance_m, hip_, from);
      }
      region.held = place.depth_m > 0;
      region.depth_m = place.depth_m;
      region.room_m = place.room_m;
      region.normal_in_world = place.normal_in_world;
      region.proxy_m_in_world = place.proxy_m_in_world;
      if (renewed_[i]) beginAtDepth(fixture(i), spring_depth_m_[i], input_.period_s, region);
      region.give_m = std::min(region.give_m, region.depth_m);
      out_.changes_j += advance(fixture(i), input_.period_s, region);
    }
  }

  /// The spring as it is exerted; its energy is in proportion to the share.
  SaturatingSpring springOf(std::size_t i) const noexcept {
    const SaturatingSpring spring = memoryOf(i).region.spring();
    return {shareOf(i) * spring.stiffness_n_per_m, shareOf(i) * spring.max_force_n};
  }

  /// Damping of one region along its normal.
  struct Damper {
    double of_lag_n_s_per_m = 0;  ///< against the lag of the spring
    double own_n_s_per_m = 0;     ///< what is configured beyond it; while approaching
  };
  Damper damperOf(std::size_t i) const noexcept {
    const RegionMemory& region = memoryOf(i).region;
    const double depth_m = region.springDepth_m();
    const SaturatingSpring spring = springOf(i);
    const double ramp = std::min(1.0, depth_m / kDampingRamp_m);
    const double saturated = std::clamp((depth_m - spring.saturation_m()) / kDampingRamp_m, 0.0, 1.0);
    const double of_lag = input_.lag_damping_s * spring.stiffness_n_per_m;
    return {(1 - saturated) * of_lag,
            ramp * std::max(0.0, shareOf(i) * fixture(i).damping_n_s_per_m - of_lag)};
  }

  /// Share of the configured damping with which all dampers together are still stable.
  double shareOfOwnDamping() const noexcept {
    JointStiffness all;
    JointStiffness of_lag;
    for (std::size_t i = 0; i < count(); ++i) {
      if (!isRegion(i) || !(memoryOf(i).region.springDepth_m() > 0)) continue;
      const Damper damper = damperOf(i);
      const Vec3& normal = memoryOf(i).region.normal_in_world;
      all.add(normal, damper.of_lag_n_s_per_m + damper.own_n_s_per_m);
      of_lag.add(normal, damper.of_lag_n_s_per_m);
    }
    const double most = input_.max_damping_n_s_per_m;
    const double together = all.largest_n_per_m();
    if (together <= most) return 1;
    const double least = of_lag.largest_n_per_m();
    return together > least ? std::clamp((most - least) / (together - least), 0.0, 1.0) : 0;
  }

  void pushFromRegions() noexcept {
    double most_n = 0;
    double own_share = -1;
    for (std::size_t i = 0; i < count(); ++i) {
      if (!isRegion(i)) continue;
      const RegionMemory& region = memoryOf(i).region;
      const double depth_m = shareOf(i) > 0 ? region.springDepth_m() : 0;
      if (depth_m > 0 || memoryOf(i).force_n > 0) out_.steepest_n_per_m += region.spring().stiffness_n_per_m;
      memoryOf(i).force_n = 0;
      if (!(depth_m > 0)) continue;
      if (own_share < 0) own_share = shareOfOwnDamping();
      const SaturatingSpring spring = springOf(i);
      const Vec3& normal = region.normal_in_world;
      const double spring_n = spring.force_n(depth_m);
      const Damper damper = damperOf(i);
      const Vec3 velocity = velocityToDamp(input_.velocity_m_per_s_in_world, speed_m_per_s_[i] * normal);
      const double speed = dot(velocity, normal);
      const double ramp = std::min(1.0, depth_m / kDampingRamp_m);
      const double of_lag_n = damper.of_lag_n_s_per_m * speed;
      const double damping_n = std::max(of_lag_n, std::min(ramp * of_lag_n, -kDampingOfSpring * spring_n)) +
                               own_share * damper.own_n_s_per_m * std::min(speed, 0.0);
      // It never pulls, and damping adds no more than the largest force.
      const double force_n = std::clamp(spring_n - damping_n, 0.0, spring.max_force_n);
      memoryOf(i).force_n = force_n;
      out_.holds = true;
      out_.in_contact |= 1U << i;
      out_.spring_force_n += spring_n * normal;
      out_.force_n += force_n * normal;
      const double energy_j = spring.energy_j(depth_m);
      out_.stored_j += energy_j;
      if (fixture(i).fades_without_depth)
        out_.changes_j += (input_.depth_share - memory_.depth_share) * region.energy_j();
      out_.damping_n_s_per_m += damper.of_lag_n_s_per_m + own_share * damper.own_n_s_per_m;
      if (isStandoff(i)) {
        out_.standoff_force_n += spring_n * normal;
        out_.standoff_j += energy_j;
        out_.standoff_power_w += spring_n * speed_m_per_s_[i];
      }
      if (spring_n > most_n) {
        most_n = spring_n;
        out_.proxy_m_in_world = region.proxy_m_in_world;
      }
    }
  }

  /// Distances of the HIP: of the regions that may be the nearest one, and of one fixture in turn.
  void computeDistances() noexcept {
    memory_.refreshed = memory_.refreshed + 1 < count() ? memory_.refreshed + 1 : 0;
    for (std::size_t i = 0; i < count(); ++i) {
      if (!isRegion(i)) continue;
      RegionMemory& region = memoryOf(i).region;
      double& distance_m = memoryOf(i).distance_m;
      const bool ended = !(shareOf(i) > 0);
      memoryOf(i).breaches.follow(region.held && !ended ? region.depth_m : 0, hip_, input_.now_ns);
      if (ended) {
        distance_m = std::numeric_limits<double>::quiet_NaN();
        continue;
      }
      if (region.held) {
        distance_m = -region.depth_m;
      } else if (isStandoff(i)) {
        distance_m = standoffDistance_m(i);
      } else if (region.room_m < out_.distance_m || memory_.refreshed == i) {
        distance_m = distanceFromRegion(region.shape, region.keeps_inside, fixture(i).clearance_m, hip_);
        region.room_m = distance_m;
      } else {
        continue;
      }
      if (distance_m < out_.distance_m) {
        out_.distance_m = distance_m;
        out_.nearest = static_cast<std::int32_t>(i);
      }
    }
  }
  double standoffDistance_m(std::size_t i) noexcept {
    if (!surface_.isAvailable()) return std::numeric_limits<double>::infinity();
    return surface_.look(hip_).signed_distance.distance_m - fixture(i).clearance_m;
  }

  void guideHip() noexcept {
    const double left = norm(memory_.left_guidance_n);
    memory_.left_guidance_n =
        left > kMaxFade_n ? ((left - kMaxFade_n) / left) * memory_.left_guidance_n : Vec3{};
    out_.guidance_force_n = memory_.left_guidance_n;
    for (std::size_t i = 0; i < count(); ++i) {
      if (!acts(i) || !isGuidance(fixture(i).kind)) continue;
      GuidanceMemory& memory = memoryOf(i).guidance;
      if (input_.engages) memory.share = 0;
      const GuidanceForce force = guide(
          {.fixture = fixture(i),
           .elements =
               std::span(input_.set.elements).subspan(fixture(i).first_element, fixture(i).element_count),
           .hip_m_in_world = hip_,
           .velocity_m_per_s = input_.velocity_m_per_s_in_world,
           .motion_m = motion_,
           .most_stiffness_n_per_m = kGuidanceShare * input_.parameters.springs.stiffness_n_per_m,
           .most_force_n = kGuidanceShare * input_.parameters.safety.max_force_n,
           .lag_damping_s = input_.lag_damping_s,
           .period_s = input_.period_s},
          memory);
      out_.guidance_force_n += shareOf(i) * force.force_n;
      out_.guidance_j += shareOf(i) * force.stored_j;
      memoryOf(i).force_n = shareOf(i) * norm(force.force_n);
      memoryOf(i).distance_m = force.located ? force.distance_m : std::numeric_limits<double>::quiet_NaN();
      if (memoryOf(i).force_n > 0) out_.in_contact |= 1U << i;
      guidance_[i] = force;
    }
  }

  /// Decides what share of each stiffness the limit permits: each spring alone by its own stiffness, and
  /// those that can act here by what they add up to.
  void limitStiffness() noexcept {
    const double limit = input_.max_stiffness_n_per_m;
    const auto alone = [limit](double stiffness) { return stiffness > limit ? limit / stiffness : 1; };
    JointStiffness joint;
    std::array<bool, kMaxFixtures> is_near{};
    for (std::size_t i = 0; i < count(); ++i) {
      if (!acts(i)) continue;
      if (isGuidance(fixture(i).kind)) {
        is_near[i] = guidanceIsNear(i);
        if (is_near[i])
          joint.addAcross(guidance_[i].tangent_in_world, std::min(guidance_[i].stiffness_n_per_m, limit));
      } else {
        const RegionMemory& region = memoryOf(i).region;
        is_near[i] = regionIsNear(region);
        if (is_near[i]) joint.add(region.normal_in_world, std::min(region.stiffness_n_per_m, limit));
      }
    }
    const double of_law = std::min(input_.law_stiffness_n_per_m, limit);
    const bool law_matters =
        joint.largest_n_per_m() + of_law > limit && std::ranges::find(is_near, true) != is_near.end();
    const bool law_is_near = law_matters && lawIsNear();
    if (law_is_near) joint.add(memory_.law_normal_in_world, of_law);
    const double together = joint.largest_n_per_m();
    const double share = together > limit ? limit / together : 1;
    for (std::size_t i = 0; i < count(); ++i) {
      if (!acts(i)) continue;
      const bool guides = isGuidance(fixture(i).kind);
      const double stiffness = guides ? guidance_[i].stiffness_n_per_m : memoryOf(i).region.stiffness_n_per_m;
      StiffnessShare& own = guides ? memoryOf(i).guidance.stiffness_share : memoryOf(i).region.share;
      own.aimAt((is_near[i] ? share : 1) * alone(stiffness));
    }
    if (law_is_near) out_.law_share = share;
  }
  /// Whether the spring can act within kNear_m of the HIP: not where the HIP is off the region, or so deep in
  /// it that the spring is saturated, by more.
  static bool regionIsNear(const RegionMemory& region) noexcept {
    if (!region.held) return region.room_m <= kNear_m;
    return region.springDepth_m() - region.spring().saturation_m() <= kNear_m;
  }
  /// The same for the law: whether the HIP is in contact, next to where it was last, or before the surface
  /// that the law will meet.
  bool lawIsNear() noexcept {
    const ForceSample& law = input_.law;
    Vec3& place = memory_.law_place_m_in_world;
    Vec3& normal = memory_.law_normal_in_world;
    if (isHeld(law.state) || law.points_used > 0) {
      const double length_n = norm(law.force_n_in_world);
      place = isHeld(law.state) ? law.proxy_m_in_world : hip_;
      normal = law.normal_in_world == Vec3{} && length_n > 0 ? (1 / length_n) * law.force_n_in_world
                                                             : law.normal_in_world;
    } else if (surface_.isAvailable()) {
      const SurfaceDistance::Result& seen = surface_.look(hip_);
      if (seen.found()) {
        normal = seen.signed_distance.normal_in_world;
        place = hip_ - seen.signed_distance.distance_m * normal;
      }
    }
    const Vec3 off = hip_ - place;
    return !(normal == Vec3{}) && dot(off, normal) <= kNear_m && norm(off) <= kSamePlace_m;
  }
  bool guidanceIsNear(std::size_t i) const noexcept {
    const GuidanceForce& guidance = guidance_[i];
    const double stiffness = memoryOf(i).guidance.stiffness_share.value() * guidance.stiffness_n_per_m;
    const double beyond_m = guidance.distance_m - fixture(i).deadband_m;
    return guidance.located && beyond_m >= -kNear_m &&
           beyond_m - guidance.most_force_n / stiffness <= kNear_m;
  }

  const Input& input_;
  Memory& memory_;
  const Vec3 hip_;
  const Vec3 motion_;
  LiveSurface surface_;
  Output out_;
  std::array<bool, kMaxFixtures> renewed_{};           ///< changed in this tick ...
  std::array<Vec3, kMaxFixtures> from_;                ///< ... with the proxy here ...
  std::array<double, kMaxFixtures> spring_depth_m_{};  ///< ... and its spring as deep as it was
  std::array<double, kMaxFixtures> speed_m_per_s_{};
  std::array<GuidanceForce, kMaxFixtures> guidance_;
};

FixtureState FixtureForces::stateOf(std::size_t place) const noexcept {
  const FixtureMemory& memory = memory_.fixtures[place];
  FixtureState state;
  state.breach = memory.breaches.ended();
  if (memory.definition == 0) return state;
  const GuidanceMemory& guidance = memory.guidance;
  state.distance_m = memory.distance_m;
  state.force_n = memory.force_n;
  state.stiffness_n_per_m = memory.region.stiffness_n_per_m > 0
                                ? memory.region.spring().stiffness_n_per_m
                                : guidance.stiffness_share.value() * guidance.stiffness_n_per_m;
  return state;
}

FixtureForces::Output FixtureForces::step(const Input& input) HAPTICD_RT {
  Output output;
  output.proxy_m_in_world = input.hip_m_in_world;
  if (input.set.count > 0 || memory_.placed) output = Tick(input, memory_).output();
  if (input.set.count == 0 && memory_.left_guidance_n == Vec3{}) release();
  return output;
}

}  // namespace hapticd::rt
