// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "config/settings/settings.h"
#include "rt/depth/depth_frame_header.h"

namespace hapticd::drivers {

/// Returns the header fields that all raw depth frames of this camera share, for headerOf(). `identity`:
/// CameraStatus::identity; it provides the serial number if the settings accept any camera.
rt::DepthFrameHeader commonDepthHeader(const config::CameraSettings& camera, std::string_view identity);

}  // namespace hapticd::drivers
