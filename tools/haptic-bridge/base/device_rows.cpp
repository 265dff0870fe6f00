// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/base/device_rows.h"

#include <array>

namespace hapticd::tools {

std::span<const DeviceRow> deviceRows() {
  static constexpr std::array kRows{
      DeviceRow{.word = "force-dimension",
                .help = "delta, omega, sigma and lambda of Force Dimension, by libdrd.so",
                .make = makeForceDimensionDriver},
      DeviceRow{.word = "openhaptics",
                .help = "Touch, Touch X and Phantom of 3D Systems, by OpenHaptics' libHD.so",
                .make = makeOpenHapticsDriver},
      DeviceRow{.word = "inverse3",
                .help = "Haply Inverse3, by the Inverse Service of its vendor (127.0.0.1:10001)",
                .make = inverse3::makeInverse3Driver},
      DeviceRow{.word = "phantom-omni",
                .help = "Phantom Omni of SensAble with FireWire, without software of its vendor",
                .make = phantom_omni::makePhantomOmniDriver},
  };
  return kRows;
}

}  // namespace hapticd::tools
