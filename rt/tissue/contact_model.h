// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "rt/tissue/tissue.h"

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

}  // namespace hapticd::rt
