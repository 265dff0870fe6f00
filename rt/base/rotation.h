// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "rt/base/vec3.h"

namespace hapticd::rt {

/// A rotation matrix, row by row.
using Rotation = std::array<double, 9>;

/// Returns r v.  RT: safe.
constexpr Vec3 rotated(const Rotation& r, const Vec3& v) noexcept {
  return {r[0] * v.x + r[1] * v.y + r[2] * v.z, r[3] * v.x + r[4] * v.y + r[5] * v.z,
          r[6] * v.x + r[7] * v.y + r[8] * v.z};
}
/// Returns r^T v, which undoes rotated().  RT: safe.
constexpr Vec3 rotatedBack(const Rotation& r, const Vec3& v) noexcept {
  return {r[0] * v.x + r[3] * v.y + r[6] * v.z, r[1] * v.x + r[4] * v.y + r[7] * v.z,
          r[2] * v.x + r[5] * v.y + r[8] * v.z};
}

}  // namespace hapticd::rt
