// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-vendor-bridge/device_rows.h"

#include <array>

#include "tools/haptic-vendor-bridge/inverse3/inverse3_driver.h"

namespace hapticd::tools {

std::span<const DeviceRow> deviceRows() {
  static constexpr std::array kRows{
      DeviceRow{.word = "inverse3",
                .help = "Haply Inverse3, by the Inverse Service of its vendor (127.0.0.1:10001)",
                .make = inverse3::makeInverse3Driver},
  };
  return kRows;
}

}  // namespace hapticd::tools
