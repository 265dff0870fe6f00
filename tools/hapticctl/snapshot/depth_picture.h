// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/error.h"
#include "tools/hapticctl/snapshot/colour_ramp.h"
#include "tools/hapticctl/snapshot/snapshot.h"

namespace hapticd::tools {

/// The depth image as the camera sees it, one colour for each pixel, row by row: depth by colour, spread over
/// contrastRange(); black where there is no depth; a cross at the HIP where it is in front of the camera and
/// in the picture.
std::vector<Rgb> depthPicture(const Snapshot& snapshot);

/// A PNG file of the depth image, with the scale of its depths at the right. The image begins at the left
/// edge, so that columns and rows of the file are the pixels of the camera. Errors: no memory.
config::Result<std::string> pngOf(const Snapshot& snapshot);

}  // namespace hapticd::tools
