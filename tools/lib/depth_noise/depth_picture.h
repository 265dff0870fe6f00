// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace hapticd::tools {

/// Draws depths in metres, row by row and 0 for a hole, as lines of `columns` letters: '@' for the nearest,
/// '.' for the farthest, ' ' for holes. A letter stands for the mean of its part of the image, whose height
/// is twice its width, as letters are. Empty without any depth.
std::string depthPicture(const std::vector<double>& depth_m, int width_px, int height_px, int columns);

}  // namespace hapticd::tools
