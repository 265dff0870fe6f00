// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "config/base/error.h"
#include "tools/haptic-bridge/phantom_omni/packets.h"

namespace hapticd::tools::phantom_omni {

/// What was measured of one device, without which it exerts nothing: no source states it.
struct OmniCalibration {
  std::string serial;
  PerJoint<double> n_m_per_count{};       ///< torque of a joint for a count of its motor, with its sign
  bool releases_without_packets = false;  ///< its motors let go when no packets come any more
};

/// A gain outside this range is no gain of an Omni: with 2047 counts a joint then exerts less than 0.1 N m or
/// more than 2 N m, where 3.3 N at a reach of 0.135 to 0.27 m need 0.45 to 0.9 N m.
inline constexpr double kLeastGain_n_m = 5e-5;
inline constexpr double kMostGain_n_m = 1e-3;

/// Whether a gain lies in that range, with either sign.
bool isPlausibleGain(double n_m_per_count);

/// Where the calibration of a device is kept: `file` unless it is empty; else phantom-omni-SERIAL.json in
/// $STATE_DIRECTORY, in $XDG_STATE_HOME/haptic-vendor-bridge, or in ~/.local/state/haptic-vendor-bridge.
/// Errors: none of these is set.
base::Result<std::filesystem::path> calibrationFile(const std::string& file, const std::string& serial);

/// Nothing: there is no such file.
/// Errors: it cannot be read, is damaged, or belongs to a device of another serial number.
base::Result<std::optional<OmniCalibration>> readCalibration(const std::filesystem::path& file,
                                                             const std::string& serial);

/// Writes the file completely or not at all, with its folder.  Errors: the disk's.
base::Result<void> storeCalibration(const std::filesystem::path& file, const OmniCalibration& calibration);

}  // namespace hapticd::tools::phantom_omni
