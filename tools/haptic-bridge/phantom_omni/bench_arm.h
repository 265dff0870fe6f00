// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "config/base/error.h"
#include "tools/haptic-bridge/phantom_omni/arm.h"

namespace hapticd::tools::phantom_omni {

/// What a step of an arm has led to.
struct BenchStep {
  JointAngles angles_rad{};
  double seconds = 0;  ///< since the angles of the step before: what a loaded computer makes of kStep_s
};

/// An arm whose motors are driven by counts, for its calibration. Thread: one.
class BenchArm {
 public:
  static constexpr double kStep_s = 0.002;

  virtual ~BenchArm() = default;
  /// Has the motors at these counts until the next step, and returns the joints' angles kStep_s later.
  /// Without a next step the motors are turned off.  Errors: the device is lost.
  virtual base::Result<BenchStep> step(const PerJoint<int>& counts) = 0;
  /// Sends no packets for that long, as if the program had been killed, and returns the angles at the end;
  /// packets without torque follow.  Errors: the device is lost.
  virtual base::Result<JointAngles> pausePackets(double seconds) = 0;
  /// How many steps have come so late that the motion before them counts for nothing.
  virtual std::uint64_t lateSteps() const = 0;
};

}  // namespace hapticd::tools::phantom_omni
