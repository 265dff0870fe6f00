// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "rt/base/vec3.h"

namespace hapticd::tools {

inline constexpr std::int64_t kDeadManNs = 20'000'000;

/// The share of the commanded force that may be exerted when the newest valid command arrived `age_ns` ago:
/// all of it for 10 ms, none after 20 ms, and a falling share in between, so that the
/// force fades when a network stalls.
/// RT: safe.
constexpr double deadManShare(std::int64_t age_ns) {
  constexpr std::int64_t kFullNs = kDeadManNs / 2;
  if (age_ns <= kFullNs) return 1;
  if (age_ns >= kDeadManNs) return 0;
  return static_cast<double>(kDeadManNs - age_ns) / static_cast<double>(kDeadManNs - kFullNs);
}

/// Returns `force_n` with damping against the velocity along it, as in section 7 of
/// drivers/handle/udp/protocol.md: the force is never reversed, and zero stays zero. `damping_n_s_per_m`: >=
/// 0. RT: safe.
inline rt::Vec3 dampedForce(const rt::Vec3& force_n, const rt::Vec3& velocity_m_per_s,
                            double damping_n_s_per_m) {
  const double length_n = norm(force_n);
  if (!(length_n > 0)) return force_n;
  const rt::Vec3 along = (1 / length_n) * force_n;
  return std::max(0.0, length_n - damping_n_s_per_m * dot(velocity_m_per_s, along)) * along;
}

/// `force_n` cut to a length of at most `most_n`: the last limit before a person, so that a force or
/// limit that is not a number or infinite gives no force.
/// RT: safe.
inline rt::Vec3 boundedForce(const rt::Vec3& force_n, double most_n) {
  const double length_n = norm(force_n);
  if (!std::isfinite(length_n) || !std::isfinite(most_n) || most_n <= 0) return {};
  return length_n > most_n ? most_n / length_n * force_n : force_n;
}

}  // namespace hapticd::tools
