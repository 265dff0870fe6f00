// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace hapticd::tools {

struct CalibrateOptions {
  std::string serial;  ///< of the device; empty: the first one
  std::string file;    ///< to write; empty: where the driver looks for it
  double mass_kg = 0;  ///< that hangs from the stylus
};

/// Leads the person at the terminal through the calibration of a Phantom Omni's motors, and stores it.
/// Returns the exit status.
int calibratePhantomOmni(const CalibrateOptions& options);

}  // namespace hapticd::tools
