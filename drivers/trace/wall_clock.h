// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

namespace hapticd::drivers {

/// CLOCK_REALTIME and what is known of it. A box without a battery for its clock starts with a time of the
/// past, until somebody or the network sets it.
struct WallClock {
  std::int64_t realtime_ns = 0;
  bool synchronised = false;     ///< with a clock of the network, according to the kernel
  bool kept_by_battery = false;  ///< set from a clock that goes on while the computer is off

  /// Reads it. `root`: where /sys is.
  static WallClock read(const std::filesystem::path& root = "/");

  /// Whether it tells the time, as far as can be known. `latest_ns`: a time that has certainly passed, such
  /// as that of the newest trace.
  bool isSet(std::int64_t latest_ns) const;
};

}  // namespace hapticd::drivers
