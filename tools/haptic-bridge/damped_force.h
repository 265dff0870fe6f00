// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "rt/vec3.h"

namespace hapticd::tools {

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

}  // namespace hapticd::tools
