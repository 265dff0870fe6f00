// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "config/settings.h"
#include "rt/depth_frame_header.h"

namespace hapticd::drivers {

/// What all raw depth frames of this camera have in common, for headerOf(). `identity`:
/// CameraStatus::identity, for the serial number where the settings take the first camera that is found.
rt::DepthFrameHeader commonDepthHeader(const config::CameraSettings& camera, std::string_view identity);

}  // namespace hapticd::drivers
