// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "config/settings.h"
#include "drivers/led/led_panel.h"

namespace hapticd::drivers {

/// Creates the LED driver selected by the settings; it is not started.
std::unique_ptr<LedPanel> makeLedPanel(const config::LedSettings& settings);

}  // namespace hapticd::drivers
