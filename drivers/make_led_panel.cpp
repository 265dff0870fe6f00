// SPDX-License-Identifier: Apache-2.0
#include "drivers/make_led_panel.h"

#include "drivers/led/gpiod/gpiod_leds.h"
#include "drivers/led/none/no_leds.h"

namespace hapticd::drivers {

std::unique_ptr<LedPanel> makeLedPanel(const config::LedSettings& settings) {
  switch (settings.driver) {
    case config::LedDriver::none:
      return std::make_unique<NoLeds>();
    case config::LedDriver::gpiod:
      return std::make_unique<GpiodLeds>(settings);
  }
  return nullptr;  // the configuration accepts no other value
}

}  // namespace hapticd::drivers
