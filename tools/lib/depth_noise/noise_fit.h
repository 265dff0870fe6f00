// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "rt/parameters.h"

namespace hapticd::tools {

/// Noise of the pixels whose mean depth lies in one interval.
struct NoiseAtDepth {
  double depth_m = 0;
  double changing_m = 0;     ///< standard deviation from frame to frame
  double standing_m = 0;     ///< standard deviation of what is the same in each frame; 0 if not measured
  std::size_t pixels = 0;    ///< at this depth
  bool has_standing = true;  ///< whether the standing part was measured

  double sigma_m() const;  ///< of both parts
};

/// Fits sigma(Z) = c0 + c1 Z + c2 Z^2, all at least 0, with as few terms as explain the measurements. Where
/// these span less than a third of their depth, the one term of the camera's principle is fitted: c0 for time
/// of flight, c2 otherwise. The standing share is the mean one. Depths without a measurement of the standing
/// part are left out unless it was measured nowhere. Nothing without measurements.
std::optional<rt::DepthNoiseParameters> fittedNoise(std::span<const NoiseAtDepth> at_depths,
                                                    rt::DepthPrinciple principle);

}  // namespace hapticd::tools
