// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "config/base/error.h"

namespace hapticd::config {

/// Vendor and product id of a HID device.
struct HidId {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;

  bool operator==(const HidId&) const = default;
};

/// Parses "vvvv:pppp", four hexadecimal digits each, as shown by lsusb.
/// Errors (without a place): another form, vendor 0000.
base::Result<HidId> hidIdFrom(std::string_view text);

/// Returns e.g. "046d:c626".
std::string textOf(const HidId& id);

}  // namespace hapticd::config
