// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "rt/base/parameters.h"
#include "rt/base/realtime_safe.h"
#include "rt/base/vec3.h"
#include "rt/laws/force_law.h"
#include "rt/tissue/tissue.h"
#include "rt/tissue/tissue_shares.h"

/// The contact models of tissue in closed form.
namespace hapticd::rt {

/// A contact at one depth. The force along the normal is force_n + damping_n_s_per_m d', at least 0.
struct ModelContact {
  double force_n = 0;            ///< static force, >= 0
  double energy_j = 0;           ///< stored: the integral of force_n over the depth
  double tangent_n_per_m = 0;    ///< derivative of force_n by the depth
  double damping_n_s_per_m = 0;  ///< >= 0
};

/// Half of the depth over which the stiffness of a layered contact passes from one layer to the next.
inline constexpr double kHalfLayerCorner_m = 0.0005;

/// Returns the contact with a linear spring and damper.  RT: safe.
constexpr ModelContact linearContact(double stiffness_n_per_m, double damping_n_s_per_m,
                                     double depth_m) noexcept {
  const double force = stiffness_n_per_m * depth_m;
  return {force, force * depth_m / 2, stiffness_n_per_m, damping_n_s_per_m};
}

/// Returns the contact of Hunt and Crossley: K d^n (1 + a d'), where K d^n is `region.stiffness_n_per_m`
/// times d at kReferenceDepth_m.  RT: safe.
inline ModelContact huntCrossleyContact(const TissueRegion& region, double depth_m) noexcept {
  const double n = region.exponent;
  const double secant = region.stiffness_n_per_m * std::pow(depth_m / kReferenceDepth_m, n - 1);
  const double force = secant * depth_m;
  return {force, force * depth_m / (n + 1), n * secant, region.damping_per_speed_s_per_m * force};
}

/// Returns the contact with two layers. The stiffness changes linearly over the corner, so that it has no
/// step.  RT: safe.
inline ModelContact layeredContact(const TissueRegion& region, double depth_m) noexcept {
  ModelContact contact = linearContact(region.stiffness_n_per_m, region.damping_n_s_per_m, depth_m);
  const double half = std::min(kHalfLayerCorner_m, region.layer_m);
  const double beyond = depth_m - region.layer_m;
  if (beyond <= -half) return contact;
  const double more = region.lower_stiffness_n_per_m - region.stiffness_n_per_m;
  if (beyond >= half) {
    contact.force_n += more * beyond;
    contact.energy_j += more * (beyond * beyond / 2 + half * half / 6);
    contact.tangent_n_per_m += more;
    return contact;
  }
  const double into = beyond + half;
  contact.force_n += more * into * into / (4 * half);
  contact.energy_j += more * into * into * into / (12 * half);
  contact.tangent_n_per_m += more * into / (2 * half);
  return contact;
}

/// Returns the contact with the tissue of `region`. `depth_m`: >= 0.  RT: safe.
inline ModelContact contactOf(const TissueRegion& region, double depth_m) noexcept {
  switch (region.model) {
    case ContactModel::linear:
      break;
    case ContactModel::hunt_crossley:
      return huntCrossleyContact(region, depth_m);
    case ContactModel::layered:
      return layeredContact(region, depth_m);
  }
  return linearContact(region.stiffness_n_per_m, region.damping_n_s_per_m, depth_m);
}

/// The contact at the proxy as the stages after the law need it.
struct LocalContact {
  bool in_tissue = false;       ///< the force is that of a stiffness map; otherwise of springs of k_s
  double tangent_n_per_m = 0;   ///< derivative of the force along the normal by the depth
  double secant_n_per_m = 0;    ///< that force by the depth, at a depth of at least 1 mm
  double steepest_n_per_m = 0;  ///< bound of the force's change per displacement, now and at the last tick
  double largest_n_per_m = 0;   ///< largest tangent stiffness that a contact can have
  double damping_n_s_per_m = 0;
  double friction = 0;       ///< Coulomb's coefficient
  double energy_j = 0;       ///< stored; only in tissue
  std::int32_t region = -1;  ///< region of the map with the largest share; -1: none
  double cue_force_n = 0;    ///< amplitude of the palpation cue
  double cue_hz = 0;         ///< its frequency; of the region with the largest share of it
};

/// Contact with a stiffness map: replaces the law's force along the normal by that of the regions at the
/// proxy. Regions pass into each other by weights w_i, so that the stored energy is U = sum w_i u_i(d), with
/// u_i that of the models at the depth d. The static force is minus its gradient,
///   F = sum w_i f_i n - sum u_i grad_t w_i,
/// so that it gives no energy on any closed path of the HIP over a flat surface; on a curved one the second
/// term neglects its curvature. Where friction holds the proxy it also holds the second term. The force never
/// pulls.
///
/// A region's stiffness does not rise while the HIP is in contact, and falls at most kFall_n_per_m_per_s. A
/// region that comes in during a contact is not stiffer than what was there until the contact ends.
/// Everything else that changes with the map is left to ForceBlend.
///
/// Thread: one.  Progress: wait-free.  RT: safe.
class TissueContact {
 public:
  /// Largest rate at which a stiffness falls in contact, in N/m per second.
  static constexpr double kFall_n_per_m_per_s = 1000;
  /// Depth at which `LocalContact::largest_n_per_m` is taken.
  static constexpr double kDeep_m = 0.01;

  struct Input {
    const TissueMap* map = nullptr;  ///< null: none
    const DepthModel* model = nullptr;
    const ContactParameters& parameters;  ///< of the contact where no region is ...
    double stiffness_n_per_m;             ///< ... and its stiffness: k_s in effect
    Vec3 hip_m_in_world{};
    Vec3 velocity_m_per_s_in_world{};  ///< of the HIP
    double period_s = 0;
  };

  /// Stiffness in effect of one region.
  struct Following {
    std::uint32_t identity = 0;
    double stiffness_n_per_m = 0;
    double lower_stiffness_n_per_m = 0;
  };
  /// All that the next force depends on.
  struct Memory {
    bool active = false;  ///< the map had regions
    bool in_contact = false;
    std::uint64_t generation = 0;
    std::uint32_t count = 0;
    std::array<Following, kMaxTissueRegions> following{};
    double friction = 0;          ///< for the law's next evaluation
    double steepest_n_per_m = 0;  ///< of the last tick alone
    LocalContact contact;         ///< of the last tick
    double largest_n_per_m = 0;   ///< of the regions
  };

  /// Returns true if the map has regions.  RT: safe.
  static bool isActive(const TissueMap* map) noexcept { return map != nullptr && map->count > 0; }
  /// Returns the generation of a map that has regions, otherwise 0.  RT: safe.
  static std::uint64_t generationOf(const TissueMap* map) noexcept {
    return isActive(map) ? map->generation : 0;
  }

  /// Returns the coefficient of friction for the law. The law's friction holds a displacement in proportion
  /// to the depth, by springs of k_s; this value makes that Coulomb's friction of the force in tissue.
  double frictionOfLaw(const ContactParameters& parameters) const HAPTICD_RT {
    return memory_.active ? memory_.friction : parameters.friction;
  }

  /// Passes a law's sample through the map and replaces its force. Without regions, or without a contact with
  /// a proxy, the force stays as it is. Where the scene is not modelled, the last contact is returned. Called
  /// once per tick.
  LocalContact apply(const Input& input, ForceSample& sample) HAPTICD_RT;

  /// Forgets the contact.
  void release() HAPTICD_RT { memory_ = {}; }

  const Memory& memory() const HAPTICD_RT { return memory_; }
  void restore(const Memory& memory) HAPTICD_RT { memory_ = memory; }

 private:
  void follow(const TissueMap& map, bool in_contact, double period_s) HAPTICD_RT;
  void takeOver(const TissueMap& map, bool in_contact) HAPTICD_RT;

  Memory memory_;
};
static_assert(std::is_trivially_copyable_v<TissueContact::Memory>);

}  // namespace hapticd::rt
