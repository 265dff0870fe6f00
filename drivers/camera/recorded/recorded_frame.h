// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "rt/parameters.h"

namespace hapticd::drivers {

/// Pose of the camera's optical frame (x to the right, y down, z forwards) in the world of a data set.
struct RecordedPose {
  rt::Vec3 position_m;
  double qx = 0;  ///< unit quaternion of the rotation
  double qy = 0;
  double qz = 0;
  double qw = 1;
};

/// One depth frame of a recording.
struct RecordedFrame {
  std::string file;          ///< file name in the recording's folder
  std::int64_t host_ns = 0;  ///< host time since the first depth frame of the recording; never decreases

  /// Host time as given in the recording: CLOCK_REALTIME of the recording host.
  std::int64_t realtime_ns = 0;
  std::uint32_t device_ticks = 0;           ///< the camera's own counter; 0 if it has none
  std::optional<std::int64_t> exposure_ns;  ///< host time at mid-exposure, on the clock of realtime_ns
  std::optional<RecordedPose> pose;
};

}  // namespace hapticd::drivers
