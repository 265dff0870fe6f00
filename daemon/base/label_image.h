// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "config/fixture_settings.h"
#include "rt/depth_frame.h"

namespace hapticd::daemon {

/// The labels in the label image, one byte for each pixel of the depth image; empty: there is no image.
inline std::string_view labelsOf(const config::SceneAdditions& additions) {
  const std::string_view image = additions.label_image;
  // the pixels of a portable graymap are its last bytes
  return image.size() < rt::kFramePixels ? std::string_view() : image.substr(image.size() - rt::kFramePixels);
}

}  // namespace hapticd::daemon
