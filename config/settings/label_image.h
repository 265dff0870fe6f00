// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "config/base/error.h"

namespace hapticd::config {

/// One label for each pixel of a camera's depth image; 0: no region.
struct LabelImage {
  int width_px = 0;  ///< 0: there is no image
  int height_px = 0;
  std::string labels = {};  ///< width_px * height_px bytes, row by row
};

/// Loads a label image: a binary portable graymap (P5) of 8 bits, of the size of the camera's depth image,
/// which is at most kMaxFrameWidth x kMaxFrameHeight pixels. Errors: each kind of file that is no such image,
/// with the remedy. Thread: any.  Progress: blocking on the disk.
base::Result<LabelImage> loadLabelImage(const std::filesystem::path& file);

}  // namespace hapticd::config
