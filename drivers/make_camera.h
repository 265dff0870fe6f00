// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "config/settings.h"
#include "drivers/camera/camera.h"

namespace hapticd::drivers {

/// The camera driver that the settings name; not started.
std::unique_ptr<Camera> makeCamera(const config::CameraSettings& settings,
                                   const config::SyntheticSettings& synthetic);

}  // namespace hapticd::drivers
