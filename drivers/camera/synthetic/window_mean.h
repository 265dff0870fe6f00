// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace hapticd::drivers {

/// Turns independent cells of variance 1, one per pixel, into an image of variance 1 whose pixels share the
/// cells of a square window, as the errors of matching by windows do. The image wraps around; `width` and
/// `height` are at least `window`. RT: not safe (allocates).
void smoothOverWindow(int window, int width, int height, std::span<const float> cells,
                      std::span<float> image);

}  // namespace hapticd::drivers
