// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "config/hid_id.h"

namespace hapticd::tools {

/// The value of a variable in a uevent file; empty if it is absent.
std::string variableOf(const std::string& uevent, const std::string& name);

/// Vendor and product in the uevent of a HID device, "HID_ID=0003:0000046D:0000C626"; nothing if absent.
std::optional<config::HidId> hidIdIn(const std::string& uevent);

}  // namespace hapticd::tools
