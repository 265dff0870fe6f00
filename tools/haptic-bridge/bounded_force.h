// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "rt/vec3.h"

namespace hapticd::tools {

/// `force_n` cut to a length of at most `most_n`: the last limit before a person, so that a force or
/// limit that is not a number or infinite gives no force.
/// RT: safe.
inline rt::Vec3 boundedForce(const rt::Vec3& force_n, double most_n) {
  const double length_n = norm(force_n);
  if (!std::isfinite(length_n) || !std::isfinite(most_n) || most_n <= 0) return {};
  return length_n > most_n ? most_n / length_n * force_n : force_n;
}

}  // namespace hapticd::tools
