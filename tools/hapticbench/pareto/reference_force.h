// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "rt/depth_frame.h"
#include "rt/parameters.h"
#include "rt/vec3.h"

namespace hapticd::tools {

/// The paper's law computed directly: every pixel by eq. (1)-(2), every distance, a full sort, all in
/// double precision. Shares no code with the core; the oracle of the others. The camera's frame is the
/// world's.
class ReferenceForce {
 public:
  ReferenceForce(const rt::DepthFrame& frame, const rt::DepthModelParameters& parameters);

  struct Sample {
    rt::Vec3 force_n;
    /// Distance in metres by which the next point is farther than the last one chosen; below 1e-6 either
    /// choice is right.
    double gap_m = 1;
  };
  Sample at(const rt::Vec3& hip_m, const rt::SpringParameters& springs) const;

  const std::vector<rt::Vec3>& points_m() const noexcept { return points_m_; }

 private:
  std::vector<rt::Vec3> points_m_;
};

}  // namespace hapticd::tools
