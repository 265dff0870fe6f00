// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/base/error.h"
#include "tools/haptic-bridge/phantom_omni/bench_arm.h"
#include "tools/haptic-bridge/phantom_omni/calibration.h"
#include "tools/lib/device_check/person.h"

namespace hapticd::tools::phantom_omni {

/// Leads a person through the measurement of the torque for a count of each motor, with a known mass.
/// A motor's counts rise slowly until its joint leaves its rest, and fall until the joint comes back:
/// friction delays both by the same torque and is not in their mean. The mean with the mass, less that
/// without it, holds the mass, whose torque follows from its weight and the measured angles. Thread: one.
class GainMeasurement {
 public:
  static constexpr double kLeastMass_kg = 0.02;
  static constexpr double kMostMass_kg = 0.2;
  static constexpr double kUsualMass_kg = 0.1;
  static constexpr int kMostRampCounts = kMostCounts * 2 / 5;  ///< of what a motor has
  static constexpr double kCountsPerS = 200;

  GainMeasurement(BenchArm& arm, Person& person, double mass_kg)
      : arm_(arm), person_(person), mass_kg_(mass_kg) {}

  /// Measures everything but the serial number.
  /// Errors: a gain is not found or implausible, the device is lost, the person gave up.
  base::Result<OmniCalibration> run();

 private:
  /// The signed counts of one motor while its joint goes away from its rest, past a mark, and comes back.
  struct Sweep {
    enum class End { came_back, did_not_move, went_the_other_way };
    End end = End::did_not_move;
    double up_counts = 0;    ///< at the mark, on the way away
    double down_counts = 0;  ///< at the mark, on the way back
    JointAngles mark_rad{};

    double mean_counts() const { return (up_counts + down_counts) / 2; }
    double friction_counts() const;
  };
  /// How a joint moves without the mass.
  struct Unloaded {
    int sign = 1;  ///< of the counts that move it away from where the mass pulls
    Sweep sweep;
  };
  struct Loaded {
    int sign = 1;  ///< of the counts that move it away
    double n_m_per_count = 0;
    double mean_counts = 0;  ///< that hold the joint with the mass
  };

  base::Result<void> ask(const std::string& request);
  base::Result<BenchStep> stepOf(std::size_t joint, double counts);
  base::Result<JointAngles> awaitRest();
  base::Result<Sweep> sweep(std::size_t joint, int sign);
  base::Result<Sweep> undisturbedSweep(std::size_t joint, int sign);
  base::Result<Unloaded> measureUnloaded(std::size_t joint);
  base::Result<Loaded> measureLoaded(std::size_t joint, const Unloaded& unloaded);
  double loadTorque_n_m(std::size_t joint, const JointAngles& angles_rad) const;
  base::Result<bool> releasesWithoutPackets(const Loaded& shoulder);
  base::Result<double> holdUp(const Loaded& shoulder, const JointAngles& rest_rad);

  BenchArm& arm_;
  Person& person_;
  double mass_kg_;
};

}  // namespace hapticd::tools::phantom_omni
