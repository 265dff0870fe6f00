// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/handle/hid/hid_port.h"

namespace hapticd::drivers {

/// A HidOpener that uses hidapi's hidraw backend. It enumerates all HID devices, which takes milliseconds.
/// Thread: always the same one, also used for the port.  RT: not safe.
base::Result<OpenedHid> openThroughHidapi(const HidSelection& selection);

}  // namespace hapticd::drivers
