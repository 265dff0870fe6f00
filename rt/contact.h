// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "rt/force_law.h"
#include "rt/parameters.h"
#include "rt/vec3.h"

/// What the two constraint laws share: the proxy is the point of free space that is nearest to the HIP, and a
/// spring of stiffness k_s pulls the HIP to it.
namespace hapticd::rt {

/// The proxy and what is known about it from the tick before.
struct ProxyMemory {
  bool placed = false;  ///< there is a proxy
  Vec3 position_m_in_world;
  Vec3 normal_in_world;     ///< of the surface that it rests on; zero: it is free
  std::uint64_t frame = 0;  ///< the depth frame that it was last moved in
  bool behind = false;      ///< it is where the camera does not see
  Vec3 side_in_world;       ///< of the law `proxy`: where the surface next to it faces; zero: there is none
  bool under = false;       ///< likewise: it is on the far side of that surface
  Vec3 last_slide_m;        ///< likewise: what it had left to slide, at its last step
  double slide_share = 1;   ///< likewise: of which it went
};

/// The way along the surface that is left for the proxy, given what it still has to the HIP: none as long as
/// friction holds it. Coulomb's law: it holds as long as the tangential way is no longer than `friction`
/// times the depth of the HIP below the surface, which is `offset_m` below the proxy.  RT: safe.
inline Vec3 slideOf(const Vec3& to_hip_m, const Vec3& normal, double offset_m, double friction) noexcept {
  const double along_normal = dot(to_hip_m, normal);
  const Vec3 tangential = to_hip_m - along_normal * normal;
  const double held = friction * std::max(0.0, -along_normal - offset_m);
  const double length = norm(tangential);
  return length <= held ? Vec3{} : (1 - held / length) * tangential;
}

/// Force at the HIP: the spring to the proxy, shortened by `offset_m` along the normal, and damping of the
/// HIP's velocity along the normal, which never makes the surface pull.  RT: safe.
inline Vec3 contactForce(const LawInput& input, const Vec3& proxy_m, const Vec3& normal,
                         double offset_m) noexcept {
  const Vec3 to_proxy = proxy_m - input.hip_m_in_world;
  const double depth = std::max(0.0, dot(to_proxy, normal) - offset_m);
  const Vec3 tangential = to_proxy - dot(to_proxy, normal) * normal;
  const double stiffness = input.parameters.springs.stiffness_n_per_m;
  const double damping = input.parameters.contact.damping_n_s_per_m;
  const double along_normal_n =
      std::max(0.0, stiffness * depth - damping * dot(input.hip_velocity_m_per_s_in_world, normal));
  return depth > 0 ? along_normal_n * normal + stiffness * tangential : Vec3{};
}

}  // namespace hapticd::rt
