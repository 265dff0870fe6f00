// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "rt/base/vec3.h"

namespace hapticd::rt {

/// Returns the part of the HIP's velocity that contact damping acts on. Motion along with a moving surface is
/// not opposed; a surface that moves by itself pushes through the spring only, so that a change of its
/// estimated velocity does not step the force.
/// RT: safe.
inline Vec3 velocityToDamp(const Vec3& hip_m_per_s, const Vec3& surface_m_per_s) noexcept {
  const double surface_speed = norm(surface_m_per_s);
  if (!(surface_speed > 0)) return hip_m_per_s;
  const Vec3 direction = (1 / surface_speed) * surface_m_per_s;
  const double along = dot(hip_m_per_s, direction);
  return hip_m_per_s - std::clamp(along, 0.0, surface_speed) * direction;
}

/// A contact as contact damping needs it.
struct DampedContact {
  Vec3 force_n;           ///< the law's force, after the scene blend
  Vec3 normal;            ///< unit normal out of the surface; zero: take the direction of the force
  Vec3 velocity_m_per_s;  ///< of the HIP, from velocityToDamp()
  double friction = 0;    ///< Coulomb's coefficient of friction
};

/// Returns the contact force with damping `damping_n_s_per_m` (>= 0) added. Along the normal, damping never
/// makes the surface pull. Tangentially, only contacts with friction are damped, and the tangential force
/// stays within the friction cone.
/// RT: safe.
inline Vec3 damped(const DampedContact& contact, double damping_n_s_per_m) noexcept {
  const double length_n = norm(contact.force_n);
  if (!(length_n > 0) || !(damping_n_s_per_m > 0)) return contact.force_n;
  const Vec3 normal = contact.normal == Vec3{} ? (1 / length_n) * contact.force_n : contact.normal;
  const double along_n = dot(contact.force_n, normal);
  if (!(along_n > 0)) return contact.force_n;
  const double speed = dot(contact.velocity_m_per_s, normal);
  const Vec3 pressed = std::max(0.0, along_n - damping_n_s_per_m * speed) * normal;
  const Vec3 aside_n = contact.force_n - along_n * normal;
  if (!(contact.friction > 0)) return pressed + aside_n;
  const Vec3 held_n = aside_n - damping_n_s_per_m * (contact.velocity_m_per_s - speed * normal);
  const double max_n = std::max(norm(aside_n), contact.friction * along_n);
  const double held_length_n = norm(held_n);
  return pressed + (held_length_n > max_n ? (max_n / held_length_n) * held_n : held_n);
}

}  // namespace hapticd::rt
