// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/handle/hid/hid_port.h"

namespace hapticd::drivers {

/// A HidOpener over hidapi's hidraw backend. It lists all HID devices, which takes milliseconds.
/// Thread: always the same, that of the port.  RT: not safe.
config::Result<OpenedHid> openThroughHidapi(const HidSelection& wanted);

}  // namespace hapticd::drivers
