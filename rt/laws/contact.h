// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "rt/base/parameters.h"
#include "rt/base/vec3.h"
#include "rt/laws/force_law.h"

/// State and forces shared by the two constraint laws: the proxy is the point of free space nearest to the
/// HIP, and a spring of stiffness k_s pulls the HIP towards it.
namespace hapticd::rt {

/// What holds the proxy of the law `surface` back from the HIP.
enum class Hold : std::uint8_t {
  nothing,
  surface,  ///< the visible surface, or a side of what it shows
  vanished  ///< a surface that is no longer seen; the contact is being given up
};

/// What the law `surface` keeps about its proxy from one tick to the next.
struct SurfaceContact {
  Hold hold = Hold::nothing;
  /// Displacement from the proxy to the place that the spring pulls to. Not zero while the latter moves over
  /// to another contact, or into free space.
  Vec3 lag_m_in_world;
  double lag_speed_m_per_s = 0;  ///< at which it shrinks
  Vec3 hip_m_in_world;           ///< at the last tick
  Vec3 seen_m_in_world;          ///< the proxy when its surface was last seen
  std::uint64_t frame = 0;       ///< depth frame of the last tick
  double surface_depth_m = 0;    ///< of the surface at the proxy when last seen, along the optical axis; 0:
                                 ///< none, infinite: the proxy is behind what is seen
  Vec3 surface_normal_in_camera;
  std::int64_t surface_ns = 0;  ///< Scene::frame_time_ns when it was last seen
  bool passed_over = false;     ///< something that came by a jump is in front of the proxy
};

/// The proxy and what the laws keep about it from one tick to the next.
struct ProxyMemory {
  bool placed = false;  ///< true if there is a proxy
  Vec3 position_m_in_world;
  Vec3 normal_in_world;     ///< of the surface the proxy rests on; zero: the proxy is free
  std::uint64_t frame = 0;  ///< depth frame in which the proxy last moved
  bool behind = false;      ///< the proxy is where the camera does not see
  Vec3 side_in_world;       ///< law `proxy`: normal of the surface next to the proxy; zero: none
  bool under = false;       ///< law `proxy`: the proxy is on the far side of that surface
  Vec3 last_slide_m;        ///< law `proxy`: sliding displacement that was left at the last step
  double slide_share = 1;   ///< law `proxy`: fraction of it that the last step covered
  SurfaceContact surface;   ///< law `surface`
};

/// Returns the displacement along the surface that the proxy is still to make towards the HIP, or zero while
/// friction holds it. Coulomb's law: friction holds while the tangential displacement is at most `friction`
/// times the depth of the HIP below the surface, which lies `offset_m` below the proxy.
/// RT: safe.
inline Vec3 slideOf(const Vec3& to_hip_m, const Vec3& normal, double offset_m, double friction) noexcept {
  const double along_normal = dot(to_hip_m, normal);
  const Vec3 tangential = to_hip_m - along_normal * normal;
  const double held = friction * std::max(0.0, -along_normal - offset_m);
  const double length = norm(tangential);
  return length <= held ? Vec3{} : (1 - held / length) * tangential;
}

/// Returns the depth of the HIP below the surface that holds the proxy, >= 0.  RT: safe.
inline double depthBelow(const Vec3& proxy_m, const Vec3& hip_m, const Vec3& normal,
                         double offset_m) noexcept {
  return std::max(0.0, dot(proxy_m - hip_m, normal) - offset_m);
}

/// Returns the force at the HIP in newtons: the spring to the proxy, shortened by `offset_m` along the
/// normal, plus damping of the HIP's velocity along the normal. Damping never makes the surface pull.
/// RT: safe.
inline Vec3 contactForce(const LawInput& input, const Vec3& proxy_m, const Vec3& normal,
                         double offset_m) noexcept {
  const Vec3 to_proxy = proxy_m - input.hip_m_in_world;
  const double depth = depthBelow(proxy_m, input.hip_m_in_world, normal, offset_m);
  const Vec3 tangential = to_proxy - dot(to_proxy, normal) * normal;
  const double damping = input.parameters.contact.damping_n_s_per_m;
  const double along_normal_n = std::max(
      0.0, input.stiffness_n_per_m * depth - damping * dot(input.hip_velocity_m_per_s_in_world, normal));
  return depth > 0 ? along_normal_n * normal + input.stiffness_n_per_m * tangential : Vec3{};
}

}  // namespace hapticd::rt
