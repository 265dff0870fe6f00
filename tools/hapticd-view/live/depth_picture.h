// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "rt/depth_frame_header.h"

namespace hapticd::tools::view {

/// A raw depth frame. All clients share one, so it does not change once it has been handed out.
struct DepthPicture {
  rt::DepthFrameHeader header = {};   ///< faultOf() has been checked
  std::vector<std::byte> image = {};  ///< header.imageBytes() bytes
};

}  // namespace hapticd::tools::view
