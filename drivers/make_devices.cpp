// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "drivers/driver_table.h"
#include "drivers/led/gpiod/gpiod_leds.h"

namespace hapticd::drivers {
namespace {

constexpr auto kWordOfRow = [](const auto& row) { return row.driver.word; };

}  // namespace

std::unique_ptr<Camera> makeCamera(const config::CameraSettings& settings) {
  const auto row = std::ranges::find(kCameras, config::driverOf(settings).word, kWordOfRow);
  return row->make(settings);
}

std::unique_ptr<Handle> makeHandle(const config::HandleSettings& settings,
                                   const rt::HandleScaleParameters& scale, const HandleThreadPolicy& policy) {
  const auto row = std::ranges::find(kHandles, config::driverOf(settings).word, kWordOfRow);
  return row->make(settings, scale, policy);
}

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
