// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/error.h"
#include "tools/hapticctl/snapshot/colour_ramp.h"
#include "tools/hapticctl/snapshot/snapshot.h"

namespace hapticd::tools {

/// The depth image as the camera sees it, kFramePixels colours row by row: depth by colour, black where there
/// is none, a cross at the HIP where it is in front of the camera and in the picture.
std::vector<Rgb> depthPicture(const Snapshot& snapshot);

/// The same as a PNG file. Errors: no memory.
config::Result<std::string> pngOf(const Snapshot& snapshot);

}  // namespace hapticd::tools
