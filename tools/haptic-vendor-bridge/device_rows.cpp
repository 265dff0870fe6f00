// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-vendor-bridge/device_rows.h"

#include <array>

namespace hapticd::tools {

std::span<const DeviceRow> deviceRows() {
  static constexpr std::array<DeviceRow, 0> kRows{};
  return kRows;
}

}  // namespace hapticd::tools
