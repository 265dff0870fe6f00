// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "config/settings/settings.h"
#include "drivers/camera/camera.h"
#include "drivers/handle/handle.h"
#include "drivers/handle/handle_thread.h"
#include "drivers/led/led_panel.h"

namespace hapticd::drivers {

/// Creates the camera driver selected by the settings; it is not started.
std::unique_ptr<Camera> makeCamera(const config::CameraSettings& settings,
                                   const config::SyntheticSettings& synthetic);

/// Creates the handle driver selected by the settings; it is not started.
std::unique_ptr<Handle> makeHandle(const config::HandleSettings& settings,
                                   const rt::HandleScaleParameters& scale,
                                   const HandleThreadPolicy& policy = {});

/// Creates the LED driver selected by the settings; it is not started.
std::unique_ptr<LedPanel> makeLedPanel(const config::LedSettings& settings);

}  // namespace hapticd::drivers
