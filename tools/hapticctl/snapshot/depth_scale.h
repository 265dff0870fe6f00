// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "tools/hapticctl/snapshot/colour_ramp.h"
#include "tools/hapticctl/snapshot/snapshot.h"

namespace hapticd::tools {

/// Depths in metres, near_m below far_m.
struct DepthRange {
  double near_m = 0;
  double far_m = 0;
};

/// The depths over which the colours of a picture are spread: from the 1st to the 99th percentile of the
/// pixels, so that neither a few near pixels nor a far wall take all the contrast; at least 5 cm. Where
/// nothing is measured, the range of the camera.
DepthRange contrastRange(const Snapshot& snapshot);

/// Columns of the strip with the scale.
inline constexpr int kScaleWidth = 112;

/// Returns a strip to be placed at the right of a picture: the colours of the range from the nearest depth on
/// top to the farthest, with round depths beside them in metres, such as "0.80m". kScaleWidth times `height`
/// colours, row by row.
std::vector<Rgb> depthScale(const DepthRange& range, int height);

}  // namespace hapticd::tools
