// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "config/settings.h"
#include "drivers/led/led_panel.h"

namespace hapticd::drivers {

/// The LED driver that the settings name; not started.
std::unique_ptr<LedPanel> makeLedPanel(const config::LedSettings& settings);

}  // namespace hapticd::drivers
