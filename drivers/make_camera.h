// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "config/settings.h"
#include "drivers/camera/camera.h"

namespace hapticd::drivers {

/// Creates the camera driver selected by the settings; it is not started.
std::unique_ptr<Camera> makeCamera(const config::CameraSettings& settings,
                                   const config::SyntheticSettings& synthetic);

}  // namespace hapticd::drivers
