// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "tools/hapticctl/doctor/examination.h"

namespace hapticd::tools {

/// Whether leds.chip of the configuration names a GPIO chip: by path, by name ("gpiochip0") or by label, as
/// the driver takes it. `chip`: the name of its device file.
bool isChipOfLeds(const Examination& box, const std::string& chip);

/// Whether the configuration names a HID device as the handle, by vendor and product, and by serial number if
/// one is given. `node`: the name of its device file, "hidraw0".
bool isHidHandle(const Examination& box, const std::string& node);

/// Whether the configuration names a device: a GPIO chip whose lines are LEDs, or a HID device that is the
/// handle. The udev rules ask this, so that hapticd gets no device that it does not use. `device`: its device
/// file,
/// "/dev/gpiochip0".
bool isNamedDevice(const Examination& box, const std::string& device);

}  // namespace hapticd::tools
