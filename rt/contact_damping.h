#pragma once

#include <algorithm>

#include "rt/vec3.h"

namespace hapticd::rt {

/// A contact as damping sees it.
struct DampedContact {
  Vec3 force_n;           ///< of the law, after the scene blend
  Vec3 normal;            ///< of the surface, a unit vector out of it; zero: along the force
  Vec3 velocity_m_per_s;  ///< of the HIP relative to the surface
  double friction = 0;    ///< Coulomb's coefficient
};

/// The force with damping `damping_n_s_per_m` (>= 0) in contact. Along the normal it never makes the surface
/// pull. Along the surface it damps only what friction holds: the force there stays within the cone of
/// friction, and without friction it is left alone.  RT: safe.
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
  const double most_n = std::max(norm(aside_n), contact.friction * along_n);
  const double held_length_n = norm(held_n);
  return pressed + (held_length_n > most_n ? (most_n / held_length_n) * held_n : held_n);
}

}  // namespace hapticd::rt
