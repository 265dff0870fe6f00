// SPDX-License-Identifier: Apache-2.0
#include "rt/fixture_forces.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "rt/contact_damping.h"
#include "rt/fixture_proxy.h"

namespace hapticd::rt {
namespace {

/// Damping rises to its full value over this depth.
constexpr double kDampingRamp_m = 0.001;
/// Guidance is weaker than contact by this factor.
constexpr double kGuidanceShare = 1.0 / 3;
/// Change per tick of the force of guidance that has ended.
constexpr double kMaxFade_n = 0.04;

}  // namespace

/// One tick of all fixtures.
class FixtureForces::Tick {
 public:
  Tick(const Input& input, Memory& memory) noexcept
      : input_(input),
        memory_(memory),
        hip_(input.hip_m_in_world),
        regions_(input, memory),
        proxy_(input, memory, regions_) {}

  Output output() noexcept {
    out_.redefined = regions_.takeOver(proxy_.place());
    proxy_.move();
    computeForces();
    computeNearest();
    guideHip();
    memory_.generation = input_.set.generation;
    memory_.placed = true;
    memory_.proxy_m_in_world = proxy_.place();
    memory_.hip_m_in_world = hip_;
    out_.proxy_m_in_world = out_.holds ? proxy_.place() : hip_;
    return out_;
  }

 private:
  const Fixture& fixture(std::size_t i) const noexcept { return regions_.fixture(i); }
  FixtureMemory& memoryOf(std::size_t i) const noexcept { return regions_.memoryOf(i); }

  /// The force of a spring that saturates, and its energy.
  struct Spring {
    double stiffness_n_per_m;
    double most_n;
    double force_n(double depth_m) const noexcept { return std::min(stiffness_n_per_m * depth_m, most_n); }
    double energy_j(double depth_m) const noexcept {
      const double linear_m = std::min(depth_m, most_n / stiffness_n_per_m);
      return 0.5 * stiffness_n_per_m * linear_m * linear_m + most_n * (depth_m - linear_m);
    }
  };

  /// The spring that all forbidden regions have in common: the softest one with the least largest force.
  Spring commonSpring() const noexcept {
    Spring common{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    for (std::size_t i = 0; i < input_.set.count; ++i) {
      if (!regions_.isForbidden(i)) continue;
      common.stiffness_n_per_m = std::min(common.stiffness_n_per_m, fixture(i).stiffness_n_per_m);
      common.most_n = std::min(common.most_n, fixture(i).max_force_n);
    }
    return common;
  }

  /// Computes the force as the gradient of an energy, so that no closed loop of the HIP gains any: the common
  /// spring to the common proxy, and for each region the rest of its own spring to a proxy that obeys this
  /// region only.
  void computeForces() noexcept {
    Vec3 to_proxy;
    Vec3 to_surface;
    for (std::size_t k = 0; k < proxy_.holds(); ++k) {
      const FixtureProxy::Hold held = proxy_.hold(k);
      if (!(held.multiplier_m > 0)) continue;
      (held.ofSurface() ? to_surface : to_proxy) += held.multiplier_m * held.half_space.normal;
      if (!held.ofSurface()) hold(held.fixture(), held.multiplier_m);
    }
    const Spring common = commonSpring();
    if (const double depth_m = norm(to_proxy); out_.holds && depth_m > 0) {
      out_.spring_force_n = (common.force_n(depth_m) / depth_m) * to_proxy;
      out_.stored_j = common.energy_j(depth_m);
    }
    for (std::size_t i = 0; i < input_.set.count; ++i) {
      if (regions_.isForbidden(i)) pushFromOwnProxy(i, common);
    }
    out_.force_n = out_.spring_force_n;
    for (std::size_t k = 0; k < proxy_.holds(); ++k) {
      const FixtureProxy::Hold held = proxy_.hold(k);
      if (held.multiplier_m > 0 && !held.ofSurface()) damp(held);
    }
    const double surface_depth_m = norm(to_surface);
    if (out_.holds && surface_depth_m > 0)
      pushFromSurface((1 / surface_depth_m) * to_surface, surface_depth_m);
  }

  /// Notes that the HIP is `depth_m` deep in a region.
  void hold(std::size_t i, double depth_m) noexcept {
    out_.holds = true;
    out_.in_contact |= 1U << i;
    if (depth_[i] == 0) out_.stiffness_n_per_m += fixture(i).stiffness_n_per_m;
    depth_[i] += depth_m;
  }

  /// Adds what the spring of a region is stiffer or stronger than the common one. Its own proxy is the place
  /// on the region's boundary nearest to the HIP, followed like the common one.
  void pushFromOwnProxy(std::size_t i, const Spring& common) noexcept {
    const Fixture& f = fixture(i);
    FixtureMemory& memory = memoryOf(i);
    const Spring own{f.stiffness_n_per_m, f.max_force_n};
    if (!(depth_[i] > 0)) {
      memory.has_own_proxy = false;
      return;
    }
    const bool is_common = own.stiffness_n_per_m == common.stiffness_n_per_m && own.most_n == common.most_n;
    if (is_common) return;
    Vec3 proxy = memory.has_own_proxy ? memory.own_proxy_m : proxy_.place();
    HalfSpace half_space;
    constexpr int kRounds = 2;
    for (int round = 0; round < kRounds; ++round) {
      const SignedDistance here = regions_.evaluate(i, proxy);
      if (!std::isfinite(here.distance_m)) return;
      const Vec3& n = here.normal_in_world;
      half_space = {n, dot(n, proxy) - here.distance_m};
      proxy = hip_ + std::max(0.0, -half_space.room_m(hip_)) * n;
    }
    memory.has_own_proxy = true;
    memory.own_proxy_m = proxy;
    const double depth_m = std::max(0.0, -half_space.room_m(hip_));
    const double force_n = own.force_n(depth_m) - common.force_n(depth_m);
    out_.spring_force_n += force_n * half_space.normal;
    out_.stored_j += own.energy_j(depth_m) - common.energy_j(depth_m);
  }

  /// Damps the motion along the normal of a region that holds the HIP; the region never pulls.
  void damp(const FixtureProxy::Hold& held) noexcept {
    const std::size_t i = held.fixture();
    const Fixture& f = fixture(i);
    const Vec3& normal = held.half_space.normal;
    const Vec3 velocity =
        velocityToDamp(input_.velocity_m_per_s_in_world, regions_.speed_m_per_s(i) * normal);
    const double speed = dot(velocity, normal);
    const double ramp = std::min(1.0, held.multiplier_m / kDampingRamp_m);
    const double of_lag = input_.lag_damping_s * f.stiffness_n_per_m;
    const double more = std::max(0.0, f.damping_n_s_per_m - of_lag);  // its own, while approaching
    const double damping_n = ramp * (of_lag * speed + more * std::min(speed, 0.0));
    out_.damping_n_s_per_m += std::max(of_lag, f.damping_n_s_per_m);
    const double along_n = dot(out_.force_n, normal);
    const double damped_n = std::clamp(along_n - damping_n, 0.0, std::max(along_n, f.max_force_n));
    out_.force_n += (damped_n - along_n) * normal;
    if (!regions_.isStandoff(i)) return;
    const Spring own{f.stiffness_n_per_m, f.max_force_n};
    const double spring_n = own.force_n(held.multiplier_m);
    out_.standoff_force_n += spring_n * normal;
    out_.standoff_j += own.energy_j(held.multiplier_m);
    out_.standoff_power_w += spring_n * regions_.speed_m_per_s(i);
  }

  /// In a corner between a region and the live surface the proxy is deeper behind the surface than the law's
  /// own proxy; the law's spring gets the difference.
  void pushFromSurface(const Vec3& normal, double depth_m) noexcept {
    const Vec3 law_m = isHeld(input_.law.state) ? input_.law.proxy_m_in_world - hip_ : Vec3{};
    const double more_m = depth_m - std::max(0.0, dot(law_m, normal));
    if (!(more_m > 0)) return;
    const double stiffness = input_.parameters.springs.stiffness_n_per_m;
    const double most_n = input_.parameters.safety.max_force_n;
    const Vec3 force = std::min(stiffness * more_m, most_n) * normal;
    out_.spring_force_n += force;
    out_.force_n += force;
    out_.stored_j += 0.5 * stiffness * more_m * more_m;
  }

  /// Distances for warnings, and the stiffness that can act along one normal.
  void computeNearest() noexcept {
    std::array<std::size_t, FixtureProxy::kMaxHalfSpaces> near;
    std::size_t near_count = 0;
    for (std::size_t i = 0; i < input_.set.count; ++i) {
      if (!regions_.isForbidden(i)) continue;
      const Fixture& f = fixture(i);
      if (regions_.isStandoff(i)) out_.joint_stiffness_n_per_m += f.stiffness_n_per_m;
      if (memoryOf(i).room_m - memoryOf(i).give_m >= out_.distance_m) continue;  // another one is nearer
      double distance_m = -depth_[i];
      if (!(depth_[i] > 0)) {
        const double room_m = regions_.evaluate(i, hip_).distance_m;
        regions_.remember(i, room_m);
        distance_m = room_m - memoryOf(i).give_m;
      }
      if (distance_m < out_.distance_m) {
        out_.distance_m = distance_m;
        out_.nearest = static_cast<std::int32_t>(i);
      }
    }
    for (std::size_t k = 0; k < proxy_.holds(); ++k) {
      const FixtureProxy::Hold held = proxy_.hold(k);
      if (held.ofSurface() || held.half_space.room_m(hip_) > kNearRegion_m) continue;
      if (!regions_.isStandoff(held.fixture())) near[near_count++] = k;
    }
    double most = 0;
    for (std::size_t a = 0; a < near_count; ++a) {
      double sum = 0;
      for (std::size_t b = 0; b < near_count; ++b) {
        const FixtureProxy::Hold other = proxy_.hold(near[b]);
        const double along = dot(proxy_.hold(near[a]).half_space.normal, other.half_space.normal);
        sum += std::max(0.0, along) * fixture(other.fixture()).stiffness_n_per_m;
      }
      most = std::max(most, sum);
    }
    out_.joint_stiffness_n_per_m += most;
  }

  void guideHip() noexcept {
    const Vec3 motion = memory_.placed ? hip_ - memory_.hip_m_in_world : Vec3{};
    const double left = norm(memory_.left_guidance_n);
    memory_.left_guidance_n =
        left > kMaxFade_n ? ((left - kMaxFade_n) / left) * memory_.left_guidance_n : Vec3{};
    out_.guidance_force_n = memory_.left_guidance_n;
    double stiffness = 0;
    for (std::size_t i = 0; i < input_.set.count; ++i) {
      if (memoryOf(i).definition == 0 || !isGuidance(fixture(i).kind)) continue;
      const GuidanceForce guidance = guide(
          {.fixture = fixture(i),
           .elements =
               std::span(input_.set.elements).subspan(fixture(i).first_element, fixture(i).element_count),
           .hip_m_in_world = hip_,
           .velocity_m_per_s = input_.velocity_m_per_s_in_world,
           .motion_m = motion,
           .most_stiffness_n_per_m = kGuidanceShare * input_.parameters.springs.stiffness_n_per_m,
           .most_force_n = kGuidanceShare * input_.parameters.safety.max_force_n,
           .lag_damping_s = input_.lag_damping_s,
           .period_s = input_.period_s},
          memoryOf(i).guidance);
      out_.guidance_force_n += guidance.force_n;
      stiffness += guidance.stiffness_n_per_m;
      if (!(guidance.force_n == Vec3{})) out_.in_contact |= 1U << i;
    }
    out_.joint_stiffness_n_per_m += stiffness;
  }

  const Input& input_;
  Memory& memory_;
  const Vec3 hip_;
  ForbiddenRegions regions_;
  FixtureProxy proxy_;
  Output out_;
  std::array<double, kMaxFixtures> depth_{};
};

FixtureForces::Output FixtureForces::step(const Input& input) HAPTICD_RT {
  Output output;
  output.proxy_m_in_world = input.hip_m_in_world;
  if (input.set.count > 0 || memory_.placed) output = Tick(input, memory_).output();
  if (input.set.count == 0 && memory_.left_guidance_n == Vec3{}) release();
  return output;
}

}  // namespace hapticd::rt
