// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "rt/base/vec3.h"

namespace hapticd::rt {

/// A cube in the solid's frame, cut into kEdge cubes along each axis with a Part for each. Places beyond it
/// belong to the parts at its border.  RT: safe.
template <typename Part, std::size_t kEdge>
class PartCube {
 public:
  /// `edge_m`: of one part, > 0.
  PartCube(const Vec3& centre_m, double edge_m) noexcept : centre_m_(centre_m), per_m_(1 / edge_m) {}

  Part& at(const Vec3& place_m) noexcept {
    const Vec3 at = per_m_ * (place_m - centre_m_);
    return parts_[(index(at.z) * kEdge + index(at.y)) * kEdge + index(at.x)];
  }
  const auto& all() const noexcept { return parts_; }

 private:
  static std::size_t index(double at) noexcept {
    return static_cast<std::size_t>(std::clamp(std::floor(at) + kEdge / 2.0, 0.0, kEdge - 1.0));
  }
  Vec3 centre_m_;
  double per_m_;
  std::array<Part, kEdge * kEdge * kEdge> parts_{};
};

}  // namespace hapticd::rt
