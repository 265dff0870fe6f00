// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "config/error.h"

namespace hapticd::config {

/// Loads a label image: a binary portable graymap (P5) of 640 x 480 pixels of 8 bits, one label for each
/// pixel of the depth image, row by row. Returns kFramePixels bytes.
/// Errors: each kind of file that is no such image, with the remedy.
/// Thread: any.  Progress: blocking on the disk.
Result<std::string> loadLabelImage(const std::filesystem::path& file);

}  // namespace hapticd::config
